"""Wheels that roll on each other without sliding: gears, racks, belts and chains (theory, "Rolling").

These joints carry no body: other joints carry the wheels, and one constraint row couples the wheels. ``phase`` computes the rolled
angle, for symbols and numbers. The rolled angle follows from the angles of the wheels relative to their line of centres, up to a
whole number of teeth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.joints.joint_kind import E1, E2, JointKind, Rolls, angle_about_e1, slide, turn

Scalar = Any
Vector = Sequence[Scalar]
Frame = Sequence[Vector]
"""The axes e1, e2, e3 of one side's joint frame, in the world."""


def _toothed(kind: JointKind, friction: str) -> JointKind:
    """A wheel pair with tooth flanks. The flanks slide when the wheels turn, and push the wheels apart. The two freedoms of the
    pair are the relative rotation and the separation of the wheels."""
    return replace(kind, axes=((turn(E1),), (slide(E2),)), friction=friction, contacts=1)


_SPUR = JointKind(
    name="gear",
    freedoms="angle about e1 between the two wheels, distance of their axes",
    coordinates=("angle", "length"),  # the length is the distance along the line of centres
    measure=lambda r, s, ops: [angle_about_e1(r, s, ops), ops.sqrt(s[1] * s[1] + s[2] * s[2])],
    rolls=Rolls(touch="wheels", choice="internal"),
)
_CONES = JointKind(
    name="bevel_gear",
    freedoms="two wheels about axes e1 that intersect at the joint point and point to the wheels",
    rolls=Rolls(touch="cones", apart=False),
)
_STRAIGHT = JointKind(
    name="rack",
    freedoms="a wheel about the inboard e1, and a rack along the outboard e1",
    rolls=Rolls(touch="straight", wheels=1),
)
GEAR, BEVEL, RACK = _toothed(_SPUR, "flanks"), _toothed(_CONES, "bevel_flanks"), _toothed(_STRAIGHT, "flanks")
BELT = JointKind(
    name="belt",
    freedoms="two pulleys about parallel axes e1, each about its point",
    rolls=Rolls(touch="wheels", size="pitch", opposite=False, choice="crossed"),
)
FRICTION_BELT = JointKind(
    name="friction_belt",
    freedoms="sliding of the belt on its pulleys, half the change of the belt's length",
    axes=((slide(E1),), (slide(E2),)),
    friction="wrapped pulleys",
    banded="wrapped pulleys",
    rolls=Rolls(touch="wheels", size="radii", opposite=False, choice="crossed"),
    slips=True,
)
"""A flat belt or V-belt, which holds by friction only: the difference of its strands' tensions acts between the pulleys."""


@dataclass(frozen=True)
class Sizes:
    """Sizes of a pair. ``module`` is pitch diameter / number of teeth, m. ``teeth`` contains the numbers of teeth of the inboard
    and the outboard wheel. For internal teeth and for an uncrossed belt, the number of the larger wheel is negative. For a worm,
    ``module`` is the axial module, and ``lead`` is the lead angle, rad. The first number of teeth is then the number of threads
    (negative: left-handed)."""

    module: Scalar
    teeth: tuple[Scalar, Scalar]
    lead: Scalar = 0.0

    def radii(self, touch: str, ops: Any) -> tuple[Scalar, Scalar]:
        """Pitch radii of both wheels, m."""
        one, two = (0.5 * self.module * z for z in self.teeth)
        return (one * ops.cos(self.lead) / ops.sin(self.lead) if touch == "skew" else one), two


def phase(touch: str, inb: Frame, out: Frame, s: Vector, of: Sizes, ops: Any) -> Scalar:
    """Rolled angle of two wheels, rad; one tooth corresponds to 2π. ``inb`` and ``out`` are the joint frames; s = p_out − p_in."""
    (a, b), (z1, z2) = (inb[0], out[0]), of.teeth
    if touch == "straight":
        across = [x - _dot(s, b) * e for x, e in zip(s, b, strict=True)]
        return 2 * _dot(s, b) / of.module - side(a, b, s, ops) * z1 * _angle(inb, across, ops)
    if touch == "skew":
        hand = side(a, b, s, ops)
        n = [hand * x for x in cross(a, b)]
        shift = _dot(s, a) + hand * ops.sin(of.lead) / ops.cos(of.lead) * _dot(s, b)
        return hand * z2 * _angle(out, n, ops) - z1 * _angle(inb, n, ops) + 2 * shift / of.module
    if touch == "cones":
        return z1 * _angle(inb, b, ops) + z2 * _angle(out, a, ops)
    return z1 * _angle(inb, s, ops) + _dot(a, b) * z2 * _angle(out, s, ops)


def side(a: Vector, b: Vector, s: Vector, ops: Any) -> Scalar:
    """Side of the rack relative to the wheel: the sign of s · (a × b) for the wheel's axis a and the rack's direction b."""
    return ops.if_else(_dot(s, cross(a, b)) < 0, -1.0, 1.0)


def _angle(frame: Frame, v: Vector, ops: Any) -> Scalar:
    """Angle of a direction about e1, measured from e2."""
    return ops.atan2(_dot(v, frame[2]), _dot(v, frame[1]))


def cross(a: Vector, b: Vector) -> list[Scalar]:
    """a × b."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _dot(a: Vector, b: Vector) -> Scalar:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
