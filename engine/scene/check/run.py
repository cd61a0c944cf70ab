"""Settings of a run, outputs wanted, tunable numbers."""

from __future__ import annotations

from collections.abc import Iterator

from engine.scene.finding import Finding, Path
from engine.scene.model import Scene
from engine.scene.refs import GROUND
from engine.scene.suggest import did_you_mean, shown

SECTIONS = ("bodies", "joints", "forces", "gravity", "friction", GROUND)


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about the run."""
    s = scene.simulation
    at: Path = ("simulation",)
    if s.until <= 0:
        yield Finding((*at, "until"), f"the end of the run must be after its start at 0, not {s.until:g} s")
    if s.every is not None and s.every <= 0:
        yield Finding((*at, "every"), f"the output interval must be positive, not {s.every:g} s")
    if not 0 < s.rtol < 1:
        yield Finding((*at, "rtol"), f"the tolerance must lie between 0 and 1, not {s.rtol:g}", "for example 1e-6")
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
