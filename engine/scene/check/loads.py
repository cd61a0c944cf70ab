"""Checks of applied loads: the two ends of a spring must be different places."""

from __future__ import annotations

from collections.abc import Iterator

from engine.scene.finding import Finding, Path
from engine.scene.model import Bushing, Scene, SpringDamper
from engine.scene.refs import split
from engine.scene.suggest import shown


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about applied loads."""
    for name, f in scene.forces.items():
        if isinstance(f, SpringDamper | Bushing):
            yield from _between(("forces", name), f)


def _between(path: Path, f: SpringDamper | Bushing) -> Iterator[Finding]:
    a, b = (split(end)[0] for end in f.between)
    if a == b:
        what = "spring" if isinstance(f, SpringDamper) else f.type
        yield Finding((*path, "between"), f"both ends are on {shown(a)}", f"a {what} joins two different bodies")
