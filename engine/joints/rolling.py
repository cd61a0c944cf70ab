"""Wheels that roll on each other without sliding: gears, racks, belts and chains (METHOD, "Rolling").

Such a pair carries no body: its wheels turn on joints of their own. One row ties them. How far they have rolled is known but for
whole teeth, from how each wheel stands to the line between them: ``phase`` is that, with plain scalars, so that the same lines
serve symbols and numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from engine.joints.base import E1, E2, JointKind, Rolls, angle_about_e1, identity, no_travel, slide, turn

Scalar = Any
Vector = Sequence[Scalar]
Frame = Sequence[Vector]
"""The axes e1, e2, e3 of one side's joint frame, in the world."""


def _kind(name: str, says: str, rolls: Rolls) -> JointKind:
    return JointKind(
        name=name, freedoms=says, axes=(), coordinates=(), rotation=identity, travel=no_travel, rows_s=(), rows_r=(),
        measure=lambda r, s, ops: [], rolls=rolls,
    )  # fmt: skip




def _toothed(kind: JointKind, friction: str) -> JointKind:
    """With flanks that slide as the wheels turn against each other, and push them apart; these two have rates and no coordinate."""
    return replace(kind, axes=((turn(E1),), (slide(E2),)), friction=friction, contacts=1)


GEAR = replace(
    _toothed(
        _kind("gear", "angle about e1 between the two wheels, distance of their axes", Rolls(touch="wheels", choice="internal")),
        "flanks",
    ),
    coordinates=("angle", "length"),  # the distance is along the line of centres, whichever way that goes
    measure=lambda r, s, ops: [angle_about_e1(r, s, ops), ops.sqrt(s[1] * s[1] + s[2] * s[2])],
)
BEVEL = _toothed(
    _kind("bevel_gear", "two wheels about axes e1 that meet at its point, to the wheels", Rolls(touch="cones", apart=False)),
    "bevel_flanks",
)
RACK = _toothed(
    _kind("rack", "a wheel about the inboard e1, and a rack along the outboard e1", Rolls(touch="straight", wheels=1)), "flanks"
)
BELT = _kind(
    "belt", "two pulleys about parallel axes e1, each about its point",
    Rolls(touch="wheels", size="pitch", opposite=False, choice="crossed"),
)  # fmt: skip


@dataclass(frozen=True)
class Sizes:
    """Of a pair. module, m: pitch diameter over number of teeth; teeth: of the inboard and the outboard wheel, negative where
    teeth are inside, or where a belt is not crossed."""

    module: Scalar
    teeth: tuple[Scalar, Scalar]


def phase(touch: str, inb: Frame, out: Frame, s: Vector, of: Sizes, ops: Any) -> Scalar:
    """How far two wheels have rolled on each other, rad, 2π a tooth; s = p_out − p_in."""
    (a, b), (z1, z2) = (inb[0], out[0]), of.teeth
    if touch == "straight":
        across = [x - _dot(s, b) * e for x, e in zip(s, b, strict=True)]
        return 2 * _dot(s, b) / of.module - side(a, b, s, ops) * z1 * _angle(inb, across, ops)
    if touch == "cones":
        return z1 * _angle(inb, b, ops) + z2 * _angle(out, a, ops)
    return z1 * _angle(inb, s, ops) + _dot(a, b) * z2 * _angle(out, s, ops)


def side(a: Vector, b: Vector, s: Vector, ops: Any) -> Scalar:
    """On which side of a wheel about a its rack along b is: the sign of s · (a × b)."""
    return ops.if_else(_dot(s, cross(a, b)) < 0, -1.0, 1.0)


def _angle(frame: Frame, v: Vector, ops: Any) -> Scalar:
    """Angle of a direction about e1, from e2."""
    return ops.atan2(_dot(v, frame[2]), _dot(v, frame[1]))


def cross(a: Vector, b: Vector) -> list[Scalar]:
    """a × b."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _dot(a: Vector, b: Vector) -> Scalar:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
