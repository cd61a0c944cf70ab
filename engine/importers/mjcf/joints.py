"""Joints of MJCF: axes, limits, springs, dampers, friction."""

from __future__ import annotations

from dataclasses import field
from typing import Any

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.joints import REGISTRY, JointKind
from trunnion.importers.intermediate_linkage import Linkage
from trunnion.importers.mjcf.includes_and_defaults import Attributes, Model
from trunnion.importers.pose_matrices import Pose
from trunnion.importers.xml_reader import Element, is_zero

JOINTS = ("joint", "freejoint")
RATIO = "gear"
"""Attribute that holds an actuator's gear ratio."""
KINDS = {"hinge": "revolute", "slide": "prismatic", "ball": "spherical", "free": "free"}
CLOSING = {"connect": "spherical", "weld": "fixed"}
"""The scene's joint types of the equalities that close loops."""


@dataclass
class MjcfJoint:
    """A joint of the file.

    type    the type in MJCF
    ref     MJCF coordinate where the scene's coordinate is zero
    name    name of the scene's joint
    start   initial coordinates that are not zero
    limits  smallest and largest coordinate
    swing   time constant, s, and damping ratio of the joint's spring and damper in the initial pose
    frame   for a free joint: frame in the body to which the coordinates refer; None if unknown
    """

    type: str
    ref: float
    axis: np.ndarray
    place: np.ndarray
    more: dict[str, Any] = field(default_factory=dict)
    name: str = ""
    start: list[float] = field(default_factory=list)
    limits: tuple[float, float] | None = None
    swing: tuple[float, float] | None = None
    frame: Pose | None = field(default_factory=lambda: np.eye(4))

    @property
    def kind(self) -> JointKind:
        """The scene's joint type."""
        return REGISTRY[KINDS[self.type]]


def freedom(model: Model, e: Element, around: str, linkage: Linkage) -> MjcfJoint:
    """The freedom of a joint element."""
    said: Attributes = {"type": "free"} if e.tag == "freejoint" else model.attributes(e, around)
    kind, name = said.get("type", "hinge"), e.get("name") or e.tag
    if kind not in KINDS:
        model.found.add(e, name, f"a joint of type {kind!r}", f"one of {', '.join(KINDS)}")
        kind = "hinge"
    axis = model.three(e, said, "axis", "0 0 1")
    if not np.any(axis):
        model.found.add(e, name, "its axis is a zero vector")
        axis = np.array([0.0, 0.0, 1.0])
    own = REGISTRY[KINDS[kind]]
    angle = model.settings.angle if own.turns(0) else float
    ref = angle(model.found.number(e, "ref", said.get("ref"), 0.0)) if own.nv == 1 else 0.0
    out = MjcfJoint(kind, ref, axis, model.three(e, said, "pos", "0 0 0"))
    limited = said.get("limited", "auto")
    has_range = limited == "true" or (limited == "auto" and model.settings.auto_limits and "range" in said)
    if has_range and "limit" not in model.disabled:
        ends = model.found.numbers(e, "range", said.get("range", "0 0"), (2,)) or [0.0, 0.0]
        out.limits = (angle(ends[0]) - ref, angle(ends[1]) - ref)
    rotor = _coefficient(model, e, said, "armature")
    if rotor:
        out.more["rotor_inertia"] = rotor if own.nv == 1 else [rotor] * own.nv
    add_damping(model, e, said, own.nv, out.more)
    _spring(model, e, said, out, angle)
    lost = model.found.number(e, "frictionloss", said.get("frictionloss"), 0.0)
    out.more |= linkage.friction(name, own.name, lost if "frictionloss" not in model.disabled else 0.0)
    return out


def add_damping(model: Model, e: Element, said: Attributes, nv: int, more: dict[str, Any], scale: float = 1.0) -> None:
    """Add the damping of an element to the keys ``more`` of a joint with ``nv`` freedoms. With the numbers d1, d2, d3 of the
    attribute, the effort is scale · (d1 v + d2 |v| v + d3 v³) (MuJoCo 4.0.0); scenes have no cubic damping."""
    given = model.found.numbers(e, "damping", said["damping"], (1, 2, 3)) if "damping" in said else None
    if not given or "damper" in model.disabled:
        return
    linear, quadratic, cubic = (*given, 0.0, 0.0)[:3]
    if cubic or (quadratic and nv > 1):
        hint = "scenes support a linear and, for joints with one freedom, a quadratic term"
        model.found.add(e, e.title, f"damping is a polynomial: {said['damping']}", hint)
    elif nv > 1 and linear:
        more["damping"] = [linear] * nv
    elif linear:
        more["damping"] = more.get("damping", 0.0) + scale * linear
    if quadratic and nv == 1:
        earlier = more.get("nonlinear", {}).get("quadratic_damping", 0.0)
        more["nonlinear"] = {"quadratic_damping": earlier + scale * quadratic}


def _spring(model: Model, e: Element, said: Attributes, f: MjcfJoint, angle: Any) -> None:
    name = e.get("name") or e.tag
    stiffness = _coefficient(model, e, said, "stiffness")
    if not is_zero(said.get("springyield", "0")):
        model.found.add(e, name, "its spring yields, which scenes do not support", "remove springyield")
    swing = model.found.numbers(e, "springdamper", said.get("springdamper", "0 0"), (2,)) or [0.0, 0.0]
    f.swing = (swing[0], swing[1]) if min(swing) > 0 else None
    if "spring" in model.disabled:
        return
    if (stiffness or f.swing) and f.kind.nv > 1:
        model.found.add(e, name, f"a spring along a {f.type} joint, which scenes do not support", "replace the joint by hinges")
    elif stiffness or f.swing:
        rest = angle(model.found.number(e, "springref", said.get("springref"), 0.0)) - f.ref
        f.more["spring"] = {"stiffness": stiffness, "rest": rest}


def _coefficient(model: Model, e: Element, said: Attributes, key: str) -> float:
    """The number that an attribute gives. A polynomial is accepted if its higher coefficients are zero."""
    found = model.found.numbers(e, key, said[key], (1, 2, 3)) if key in said else None
    if found and any(found[1:]):
        model.found.add(e, e.get("name") or e.tag, f"{key} is a polynomial: {said[key]}", "scenes support only a single number")
    return found[0] if found else 0.0
