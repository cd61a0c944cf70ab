"""Checks of the outputs wanted and of the numbers that are to be tunable."""

from __future__ import annotations

from collections.abc import Iterator

from engine.basics.patterns import MOST_WILD, is_wild
from engine.scene.finding import Finding, Path
from engine.scene.model import Scene
from engine.scene.refs import GROUND
from engine.scene.suggest import Nearest, shown

SECTIONS = ("bodies", "joints", "forces", "gravity", "friction", GROUND)


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about the run."""
    owners = (*scene.bodies, *scene.joints, *scene.forces, *scene.inputs, GROUND, "time", "energy", "audit", "events")
    yield from _patterns(("outputs",), scene.outputs, owners, "nothing has the name")
    yield from _patterns(("tunable",), scene.tunable, SECTIONS, "no part of a scene is called")


def _patterns(path: Path, patterns: tuple[str, ...], known: tuple[str, ...], what: str) -> Iterator[Finding]:
    """Mistakes where the first word of a pattern, if it has no wild card, names nothing there is."""
    names = frozenset(known)
    wild = sum(map(is_wild, patterns))
    if wild > MOST_WILD:
        yield Finding(path, f"{wild} patterns with wild cards; {MOST_WILD} at most", "a few patterns with * say the same")
    for i, pattern in enumerate(patterns):
        head = pattern.partition(".")[0].partition("[")[0]
        if head and head not in names and "*" not in head and "?" not in head:
            about = tuple((s, head) for s in ("bodies", "joints", "forces", "inputs"))
            yield Finding((*path, i), f"{what} {shown(head)}", Nearest(head, known), about=about)
