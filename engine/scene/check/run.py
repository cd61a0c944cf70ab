"""Outputs wanted, tunable numbers."""

from __future__ import annotations

from collections.abc import Iterator

from engine.scene.finding import Finding, Path
from engine.scene.model import Scene
from engine.scene.refs import GROUND
from engine.scene.suggest import did_you_mean, shown

SECTIONS = ("bodies", "joints", "forces", "gravity", "friction", GROUND)


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about the run."""
    owners = (*scene.bodies, *scene.joints, *scene.forces, *scene.inputs, GROUND, "time", "energy", "audit", "events")
    yield from _patterns(("outputs",), scene.outputs, owners, "nothing has the name")
    yield from _patterns(("tunable",), scene.tunable, SECTIONS, "no part of a scene is called")


def _patterns(path: Path, patterns: tuple[str, ...], known: tuple[str, ...], what: str) -> Iterator[Finding]:
    """The first word of a pattern, where it has no wild card, names something."""
    for i, pattern in enumerate(patterns):
        head = pattern.partition(".")[0].partition("[")[0]
        if head and head not in known and "*" not in head and "?" not in head:
            about = tuple((s, head) for s in ("bodies", "joints", "forces", "inputs"))
            yield Finding((*path, i), f"{what} {shown(head)}", did_you_mean(head, known), about=about)
