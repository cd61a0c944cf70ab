"""Checks of bodiless joints. Such a joint couples two bodies that other joints carry. Some keys are allowed only at those other
joints."""

from __future__ import annotations

from collections.abc import Iterator

from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.elements.joints import REGISTRY, JointKind
from trunnion.scene.checks.joint_devices import FIELDS
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.findings.findings_and_paths import Finding, Path

NONE = ("drive", "rotor_inertia", "latch")
"""Fields that no bodiless joint may have, even if the joint has a coordinate."""


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about joints that carry no body."""
    for name, j in scene.joints.items():
        if not REGISTRY[j.type].bodiless:
            continue
        path: Path = ("joints", name)
        kind = REGISTRY[j.type]
        parts, move = _parts(kind)
        for key in (*(f for f in FIELDS if not kind.nq or f in NONE), "start"):
            if getattr(j, key) is not None:
                hint = f"move the key to a joint on which the {parts} {move}"
                yield Finding((*path, key), f"a {j.type} has no {key} of its own: {parts} {move} on other joints", hint)
        if j.pin == "outboard":
            what = f"neither {parts.replace(' and ', ' nor ')}" if " and " in parts else f"neither of two {parts}"
            yield Finding((*path, "pin"), f"{what} carries a pin", "leave it out")
        law = scene.law_of(j.friction) if j.friction is not None else ""
        if law and LAWS[law].bristles:
            yield Finding((*path, "friction"), f"the law {law} has bristles, which are not supported here", "choose another law")
        if j.cut is False:
            yield Finding((*path, "cut"), f"{parts} are only coupled here: this joint is always cut", "leave it out")


def _parts(kind: JointKind) -> tuple[str, str]:
    """Two texts: the two parts that a joint couples, and the motion of these parts."""
    if kind.rolls:
        return "wheels", "turn"
    if kind.keeps_distance:
        return "points", "move"
    if kind.follows == "freedom":
        return "shafts", "turn"
    return "curve and point" if kind.nq else "cam and follower", "move"
