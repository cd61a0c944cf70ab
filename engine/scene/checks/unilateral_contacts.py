"""Checks of joints that only push."""

from __future__ import annotations

from collections.abc import Iterator

from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.elements.joints import REGISTRY
from trunnion.scene.checks.cam_profiles import is_full_turn
from trunnion.scene.data_classes.scene import Joint, Scene
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.queries.unilateral_joints import LOCATED, NOT_LOCATED


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about contacts that begin and end."""
    able = ", ".join(k.name for k in REGISTRY.values() if k.pushes)
    found = {name: j for name, j in scene.joints.items() if j.unilateral is not None}
    laws = {j.unilateral.impact_law for j in found.values() if j.unilateral is not None}
    for name, j in found.items():
        path: Path = ("joints", name, "unilateral")
        if not REGISTRY[j.type].pushes:
            yield Finding(path, f"the contact of a {j.type} joint cannot open", f"joints that may open and close: {able}")
        elif j.unilateral is not None and j.unilateral.thickness is not None:
            yield from _without_ends((*path, "thickness"), j)
        if len(laws) > 1:
            yield Finding((*path, "impact_law"), "joints of one scene have the same impact law", "give all of them the same")
        if j.cut is False:
            yield Finding(("joints", name, "cut"), "a unilateral joint carries no body, because it is always cut", "leave it out")
        if j.start is not None:
            hint = "give start values of the joint that carries the part"
            yield Finding(("joints", name, "start"), "a unilateral joint has no start values of its own", hint)
        law = scene.law_of(j.friction) if j.friction is not None else ""
        if law and not LAWS[law].sets:
            sets = ", ".join(n for n, x in LAWS.items() if x.sets)
            yield Finding(("joints", name, "friction"), f"impacts do not support the friction law {law}", f"choose one of: {sets}")
    if found and scene.simulation.method == "moreau":
        yield Finding(("simulation", "method"), NOT_LOCATED, LOCATED)


def _without_ends(path: Path, j: Joint) -> Iterator[Finding]:
    """A finding if the wall of a contact has no free ends."""
    if REGISTRY[j.type].plays:
        yield Finding(path, "the ends of a slot are its mouths", "give slot: {mouth: both}")
    elif (j.curve is None or j.curve.closed) and (j.profile is None or is_full_turn(j.profile)):
        what = "this contact has no ends" if j.curve is None and j.profile is None else "the wall is closed, so it has no ends"
        yield Finding(path, what, "leave it out; an open curve and a profile of less than a turn have ends")
