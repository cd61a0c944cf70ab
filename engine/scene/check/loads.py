"""Checks of applied loads: the two ends of a spring must be different places."""

from __future__ import annotations

from collections.abc import Iterator

from engine.scene.finding import Finding, Path
from engine.scene.model import Scene, SpringDamper
from engine.scene.refs import split
from engine.scene.suggest import shown


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about applied loads."""
    for name, f in scene.forces.items():
        if isinstance(f, SpringDamper):
            yield from _spring(("forces", name), f)


def _spring(path: Path, f: SpringDamper) -> Iterator[Finding]:
    a, b = (split(end)[0] for end in f.between)
    if a == b:
        yield Finding((*path, "between"), f"both ends are on {shown(a)}", "a spring joins two different bodies")
