"""What a joint type is: its coordinates, its motion axes, and the constraint rows it gives when it is cut.

A joint's kinematics is written with plain scalars, so the same lines serve symbols and numbers: ``rotation(q, ops)`` takes a
sequence and a namespace with ``sin`` and ``cos`` and returns a 3×3 nested list.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

Scalar = Any
Rotation = Callable[[Sequence[Scalar], Any], list[list[Scalar]]]


E1, E2, E3 = range(3)
"""The axes of a joint frame, by index."""


@dataclass(frozen=True, kw_only=True)
class Axis:
    """One column of P^r or P^s (1, 2): unit vector ``index`` (E1, E2, E3) of the joint frame on ``side``, turning (``rot``) or
    sliding; ``by_pitch``: times pitch/2π (screw; its ``travel`` is likewise per pitch/2π)."""

    index: int
    rot: bool
    side: Literal["in", "out"] = "in"
    by_pitch: bool = False


def turn(index: int, side: Literal["in", "out"] = "in") -> Axis:
    """A turning axis fixed in the frame of one side."""
    return Axis(index=index, rot=True, side=side)


def slide(index: int, by_pitch: bool = False) -> Axis:
    """A sliding axis, fixed in the inboard frame."""
    return Axis(index=index, rot=False, by_pitch=by_pitch)


@dataclass(frozen=True, kw_only=True)
class JointKind:
    """A joint type (paper §2, §4, §5). ``engine.joints.contract`` says what must hold among these; a type that breaks it cannot be
    imported.

    name         as scenes write it.
    freedoms     the freedoms in words, in their order, for the published schema.
    axes         for every rate, the axes it moves along (a screw rate has two).
    coordinates  kind of each q: "angle", "length" or "quaternion" (four in a row, the last ones).
    rotation     (q, ops) → R, components in the outboard joint frame to the inboard joint frame.
    travel       q → s = p_out − p_in along the inboard axes.
    rows_s       indices k of (49), (r_out − r_in)·h_in^k = 0, when cut.
    rows_r       pairs (m, k) of (46), h_in^m·h_out^k = 0, when cut.
    ties         constraints that are neither: a coordinate tied to another (screw). A joint that has any cannot be cut.
    measure      (R, s, ops) → q of a joint whose parts are where they are (angles within ±π): the inverse of the two above.
    friction     name of the contact element a frictional joint of this type has ("" = none); contacts: how many it has.
    """

    name: str
    freedoms: str
    axes: tuple[tuple[Axis, ...], ...]
    coordinates: tuple[Literal["angle", "length", "quaternion"], ...]
    rotation: Rotation
    travel: Callable[[Sequence[Scalar]], list[Scalar]]
    rows_s: tuple[int, ...]
    rows_r: tuple[tuple[int, int], ...]
    ties: int = 0
    measure: Callable[[list[list[Scalar]], list[Scalar], Any], list[Scalar]]
    friction: str = ""
    contacts: int = 0

    @property
    def nq(self) -> int:
        """Number of coordinates."""
        return len(self.coordinates)

    @property
    def nv(self) -> int:
        """Number of rates (freedoms)."""
        return len(self.axes)

    @property
    def rows(self) -> int:
        """Number of constraint rows when cut."""
        return len(self.rows_s) + len(self.rows_r)

    @property
    def cuttable(self) -> bool:
        """Whether rows (46) and (49) say all that it holds."""
        return self.ties == 0

    @property
    def quaternion(self) -> int:
        """Index in q where the quaternion starts, −1 without one."""
        return self.coordinates.index("quaternion") if "quaternion" in self.coordinates else -1

    @property
    def pitched(self) -> bool:
        """Whether a joint of this type has a pitch."""
        return any(a.by_pitch for axes in self.axes for a in axes)

    @property
    def needs_axis(self) -> bool:
        """Whether it matters which way e1 points: not where it turns about all axes or none, and slides along all or none."""
        return any(sum(a.rot == rot for axes in self.axes for a in axes) in (1, 2) for rot in (True, False))

    @property
    def second_axis(self) -> int:
        """Index of the outboard axis it turns about besides an inboard one (two crossed pins), −1 when it has none."""
        return next((a.index for axes in self.axes for a in axes if a.side == "out"), -1)

    @property
    def turning(self) -> tuple[int, ...]:
        """Indices of the axes it turns about, in the order of the rates."""
        return tuple(a.index for axes in self.axes for a in axes if a.rot)

    @property
    def slides_along(self) -> int:
        """Index of the one axis it slides along by its first rate, −1 when there is no such one (a straight guide has)."""
        along = [k for k in range(self.nv) if not self.turns(k)]
        return self.axes[0][0].index if along == [0] else -1

    def turns(self, rate: int) -> bool:
        """Whether a freedom is a rotation (a screw's is), in rad; else it is a travel, in m."""
        return self.axes[rate][0].rot

    def coordinate_of(self, rate: int) -> int:
        """Index in q whose time derivative is this rate, −1 for rates of a quaternion."""
        return rate if self.quaternion < 0 or rate < self.quaternion else -1


def identity(q: Sequence[Scalar], ops: Any) -> list[list[Scalar]]:
    """R = E."""
    return [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]


def no_travel(q: Sequence[Scalar]) -> list[Scalar]:
    """s = 0."""
    return [0.0, 0.0, 0.0]


def about_e1(angle: Scalar, ops: Any) -> list[list[Scalar]]:
    """rot(e1, angle)."""
    c, s = ops.cos(angle), ops.sin(angle)
    return [[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]


def of_quaternion(e: Sequence[Scalar]) -> list[list[Scalar]]:
    """R(e), scalar first; divides by |e|², so that a quaternion slightly off unit length still gives a rotation."""
    w, x, y, z = e
    s = 2.0 / (w * w + x * x + y * y + z * z)
    wx, wy, wz = s * w * x, s * w * y, s * w * z
    xx, xy, xz = s * x * x, s * x * y, s * x * z
    yy, yz, zz = s * y * y, s * y * z, s * z * z
    return [
        [1.0 - (yy + zz), xy - wz, xz + wy],
        [xy + wz, 1.0 - (xx + zz), yz - wx],
        [xz - wy, yz + wx, 1.0 - (xx + yy)],
    ]


def angle_about_e1(r: list[list[Scalar]], s: list[Scalar], ops: Any) -> Scalar:
    """Angle of rot(e1, angle), within ±π."""
    return ops.atan2(r[2][1], r[1][1])


def to_quaternion(r: list[list[Scalar]], ops: Any) -> list[Scalar]:
    """Unit quaternion (w ≥ 0) of a rotation matrix, on the branch of its largest component."""
    a, b, c = r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]
    xy, xz, yz = r[0][1] + r[1][0], r[0][2] + r[2][0], r[1][2] + r[2][1]
    xx, yy, zz = r[0][0], r[1][1], r[2][2]
    four = [1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz]
    branches = [[four[0], a, b, c], [a, four[1], xy, xz], [b, xy, four[2], yz], [c, xz, yz, four[3]]]
    best, out = four[0], branches[0]
    for k in (1, 2, 3):
        out = [ops.if_else(four[k] > best, new, old) for new, old in zip(branches[k], out, strict=True)]
        best = ops.fmax(four[k], best)
    norm = ops.sqrt(sum(x * x for x in out))
    return [x * ops.if_else(out[0] < 0, -1, 1) / norm for x in out]


def quaternion_rate(e: Sequence[Scalar], omega: Sequence[Scalar]) -> list[Scalar]:
    """ė = ½ (0, ω) ∘ e for ω in the inboard frame."""
    w, x, y, z = e
    a, b, c = omega
    return [
        -0.5 * (a * x + b * y + c * z),
        0.5 * (a * w + b * z - c * y),
        0.5 * (b * w + c * x - a * z),
        0.5 * (c * w + a * y - b * x),
    ]


SPIN = tuple((turn(k),) for k in (E1, E2, E3))
"""The three rates of a quaternion: angular velocity along the inboard e1, e2, e3."""
