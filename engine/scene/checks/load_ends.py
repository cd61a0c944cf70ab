"""Checks of the ends of springs, bushings and attractions: the two ends must be on different bodies."""

from __future__ import annotations

from collections.abc import Iterator

from trunnion.scene.data_classes.scene import Bushing, PointGravity, Scene, SpringDamper
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.findings.name_suggestions import shown
from trunnion.scene.queries.body_references import split


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about the ends of loads."""
    for name, f in scene.forces.items():
        if isinstance(f, SpringDamper | Bushing):
            yield from _between(("forces", name), f)
        if isinstance(f, PointGravity) and split(f.on)[0] == split(f.towards)[0]:
            what = f"{shown(split(f.on)[0])} attracts itself"
            yield Finding(("forces", name, "towards"), what, "give a point of another body or of the ground")
        if isinstance(f, PointGravity) and split(f.on)[1]:
            yield Finding(("forces", name, "on"), "the attraction acts at the mass centre", f"write {split(f.on)[0]}")


def _between(path: Path, f: SpringDamper | Bushing) -> Iterator[Finding]:
    a, b = (split(end)[0] for end in f.between)
    if a == b:
        what = "spring" if isinstance(f, SpringDamper) else f.type
        yield Finding((*path, "between"), f"both ends are on {shown(a)}", f"connect two different bodies with the {what}")
