"""Checks of joint frames: missing axes, zero vectors as directions, references parallel to the axis; also pitch and stiffness."""

from __future__ import annotations

import math
from collections.abc import Iterator

from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes.scene import AxisAngle, Direction, Joint, Scene, Side
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.queries.body_poses_and_joint_sides import cross, unit, vector
from trunnion.scene.queries.body_references import axes_of

PARALLEL = 1e-6
"""Smallest sine of the angle between axis and reference; below it, rounding errors would determine e2."""


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about frames."""
    for name, j in scene.joints.items():
        path: Path = ("joints", name)
        yield from _written(path, j)
        for key, side in (("inboard", j.inboard), ("outboard", j.outboard)):
            yield from _side(path, key, side, j)
        yield from _pitch(path, j)
        if j.stiffness is not None and REGISTRY[j.type].nv == 6:
            yield Finding((*path, "stiffness"), f"a {j.type} joint has no contacts", "remove it")


def _written(path: Path, j: Joint) -> Iterator[Finding]:
    """A finding for every direction that is a zero vector."""
    for key, owner in ((), j), (("inboard",), j.inboard), (("outboard",), j.outboard):
        if isinstance(owner, str):
            continue
        for field in ("axis", "reference"):
            yield from _nonzero((*path, *key, field), getattr(owner, field))
    if j.start is not None and isinstance(j.start.q, AxisAngle):
        yield from _nonzero((*path, "start", "q", "axis"), j.start.q.axis)


def _nonzero(path: Path, d: Direction | None) -> Iterator[Finding]:
    if d is not None and not any(vector(d)):
        yield Finding(path, "a direction of zero length", "give x, y, z or three numbers that are not all zero")


def _side(path: Path, key: str, side: str | Side, j: Joint) -> Iterator[Finding]:
    """Findings about the frame of one side. The frame follows from the side's own axis and reference, or from those of the
    joint."""
    own = side.reference if isinstance(side, Side) else None
    axis, reference = axes_of(j, side)
    axes = ((*path, "axis"), (*path, "inboard", "axis"), (*path, "outboard", "axis"))
    if axis is None:
        if REGISTRY[j.type].needs_axis:
            other = j.outboard if key == "inboard" else j.inboard
            alone = isinstance(other, Side) and other.axis is not None
            what = f"a {j.type} joint needs an axis" + (" on both sides" if alone else "")
            at = (*path, key, "axis") if alone else (*path, "axis")
            yield Finding(at, what, "add axis: x, y, z or three numbers", about=axes)
        elif reference is not None:
            what, hint = "a reference without an axis has no effect", "add axis, or remove it"
            yield Finding((*path, "reference"), what, hint, about=axes)
        return
    if reference is None or not any(vector(axis)) or not any(vector(reference)):
        return
    if math.hypot(*cross(unit(vector(axis)), unit(vector(reference)))) < PARALLEL:
        at = (*path, key, "reference") if own is not None else (*path, "reference")
        second = REGISTRY[j.type].second_axis
        role = f"; its e{second + 1} is the second axis of the {j.type} joint" if second >= 0 else ""
        yield Finding(at, f"the reference is parallel to the axis{role}", "choose a direction across the axis")


def _pitch(path: Path, j: Joint) -> Iterator[Finding]:
    pitched = REGISTRY[j.type].pitched
    if pitched and j.pitch is None:
        what = f"a {j.type} needs a nonzero pitch (travel per turn)"
        yield Finding((*path, "pitch"), what, 'for example pitch: "5 mm"')
    if not pitched and j.pitch is not None and not REGISTRY[j.type].bodiless:
        able = " or ".join(k.name for k in REGISTRY.values() if k.pitched)
        yield Finding((*path, "pitch"), f"a {j.type} joint has no pitch", f"remove it, or use type: {able}")
