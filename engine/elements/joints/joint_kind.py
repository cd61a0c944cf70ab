"""Joint types: coordinates, motion axes, and the constraint rows of a cut joint.

Plain scalars describe kinematics, so that the same lines serve symbols and numbers: ``rotation(q, ops)`` takes a sequence and a
namespace with ``sin`` and ``cos`` and returns a 3×3 nested list."""

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
    """One column of P^r (turning, ``rot``) or P^s (sliding) of the paper's (1), (2): unit vector ``index`` (E1, E2, E3) of the
    joint frame on ``side``. by_pitch: the column is multiplied by pitch/2π (a screw, whose ``travel`` is for a pitch of 2π)."""

    index: int
    rot: bool
    side: Literal["in", "out"] = "in"
    by_pitch: bool = False


def turn(index: int, side: Literal["in", "out"] = "in") -> Axis:
    """A rotation axis, fixed in the frame of one side."""
    return Axis(index=index, rot=True, side=side)


def slide(index: int, by_pitch: bool = False) -> Axis:
    """A sliding axis, fixed in the inboard frame."""
    return Axis(index=index, rot=False, by_pitch=by_pitch)


@dataclass(frozen=True, kw_only=True)
class Rolls:
    """Rolling of two parts without sliding.

    touch: wheels about parallel axes, about axes that meet (cones), or a wheel and a rack (straight). wheels: their count. apart:
    whether the two points are the wheels' centres, not one place. size: number in a scene beside numbers of teeth. opposite:
    whether the wheels turn opposite ways; choice: key that reverses this ("": none)."""

    touch: Literal["wheels", "cones", "straight"]
    wheels: int = 2
    apart: bool = True
    size: Literal["module", "pitch"] = "module"
    opposite: bool = True
    choice: Literal["", "internal", "crossed"] = ""


def identity(q: Sequence[Scalar], ops: Any) -> list[list[Scalar]]:
    """R = E of a joint that does not turn."""
    return [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]


def no_travel(q: Sequence[Scalar]) -> list[Scalar]:
    """s = 0 of a joint that does not slide."""
    return [0.0, 0.0, 0.0]


@dataclass(frozen=True, kw_only=True)
class JointKind:
    """A joint type (paper §2, §4, §5). ``trunnion.elements.joints.declaration_checks`` says what must hold among its parts; a type
    that breaks it cannot be imported.

    name         as scenes write it.
    freedoms     the freedoms in words, in their order, for the published schema.
    axes         for every rate, the axes it moves along (a screw rate has two).
    coordinates  kind of each q: "angle", "length" or "quaternion" (four in a row, the last ones).
    rotation     (q, ops) → R (3×3), which turns components in the outboard joint frame into components in the inboard one.
    travel       q → s = p_out − p_in, components along the inboard axes.
    rows_s       when cut: indices k of the translational constraints (r_out − r_in)·h_in^k = 0, (49).
    rows_r       when cut: pairs (m, k) of the rotational constraints h_in^m·h_out^k = 0, (46).
    ties         number of constraints of neither form: a coordinate tied to another (screw). A joint that has any cannot be cut.
    measure      (R, s, ops) → q, the inverse of ``rotation`` and ``travel`` (angles within ±π).
    friction     name of the contact element a frictional joint of this type has ("" = none); contacts: how many it has.
    rolls        two wheels that roll on each other (``elements.joints.wheel_pairs``). Such a joint carries no body and has one row.
    follows      part of the outboard body that follows a curve around the inboard one ("curve": a point on any curve in a plane),
                 or a freedom that follows another (``elements.joints.cam_and_curve_followers``). Such a joint has one row.
    """

    name: str
    freedoms: str
    axes: tuple[tuple[Axis, ...], ...] = ()
    coordinates: tuple[Literal["angle", "length", "quaternion"], ...] = ()
    rotation: Rotation = identity
    travel: Callable[[Sequence[Scalar]], list[Scalar]] = no_travel
    rows_s: tuple[int, ...] = ()
    rows_r: tuple[tuple[int, int], ...] = ()
    ties: int = 0
    measure: Callable[[list[list[Scalar]], list[Scalar], Any], list[Scalar]] = lambda r, s, ops: []
    friction: str = ""
    contacts: int = 0
    rolls: Rolls | None = None
    follows: Literal["", "point", "face", "curve", "freedom"] = ""

    @property
    def bodiless(self) -> bool:
        """Whether the joint only couples parts that other joints carry."""
        return self.rolls is not None or bool(self.follows)

    @property
    def apart(self) -> bool:
        """Whether its two points lie on two parts that touch elsewhere."""
        return self.rolls.apart if self.rolls else self.follows in ("point", "face", "curve")

    @property
    def nq(self) -> int:
        """Number of coordinates q."""
        return len(self.coordinates)

    @property
    def nv(self) -> int:
        """Number of rates, that is, of freedoms."""
        return len(self.axes)

    @property
    def rows(self) -> int:
        """Number of constraint rows when cut."""
        return self.travels + len(self.rows_r)

    @property
    def travels(self) -> int:
        """How many of these rows constrain a travel, in m; they come first."""
        return len(self.rows_s) + self.bodiless

    @property
    def cuttable(self) -> bool:
        """Whether rows (46) and (49) express all constraints."""
        return self.ties == 0

    @property
    def quaternion(self) -> int:
        """Index in q where the quaternion starts; −1: none."""
        return self.coordinates.index("quaternion") if "quaternion" in self.coordinates else -1

    @property
    def pitched(self) -> bool:
        """Whether a joint of this type has a pitch."""
        return any(a.by_pitch for axes in self.axes for a in axes)

    @property
    def needs_axis(self) -> bool:
        """Whether the direction of e1 matters. It does not for a type that turns about all axes or none, and slides along all or
        none."""
        scarce = (sum(a.rot == rot for axes in self.axes for a in axes) in (1, 2) for rot in (True, False))
        return self.bodiless or any(scarce)

    @property
    def second_axis(self) -> int:
        """Index of the outboard axis about which the joint turns besides an inboard one (two crossed pins); −1: none."""
        return next((a.index for axes in self.axes for a in axes if a.side == "out"), -1)

    @property
    def turning(self) -> tuple[int, ...]:
        """Indices of the axes the joint turns about, in the order of the rates."""
        return tuple(a.index for axes in self.axes for a in axes if a.rot)

    @property
    def slides_along(self) -> int:
        """Index of the single axis along which the joint slides by its first rate (a straight guide); −1: none."""
        along = [k for k in range(self.nv) if not self.turns(k)]
        return self.axes[0][0].index if along == [0] else -1

    @property
    def freely_rubbed(self) -> tuple[bool, ...]:
        """For friction that acts along each freedom by itself: whether each freedom turns; () where a joint cannot have such
        friction."""
        return tuple(self.turns(k) for k in range(self.nv)) if 0 < self.nv <= 2 and self.quaternion < 0 else ()

    def turns(self, rate: int) -> bool:
        """Whether a freedom is a rotation, in rad (also a screw's), not a travel, in m."""
        return self.axes[rate][0].rot

    def coordinate_of(self, rate: int) -> int:
        """Index in q of the coordinate whose derivative is this rate; −1: none (quaternion, sliding along a curve)."""
        return rate if rate < (self.nq if self.quaternion < 0 else self.quaternion) else -1


def about_e1(angle: Scalar, ops: Any) -> list[list[Scalar]]:
    """The rotation by an angle about e1."""
    c, s = ops.cos(angle), ops.sin(angle)
    return [[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]


def of_quaternion(e: Sequence[Scalar]) -> list[list[Scalar]]:
    """R of a quaternion, scalar first. Division by |e|² gives a rotation also for a quaternion slightly off unit length."""
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
    """The angle of a rotation about e1, within ±π."""
    return ops.atan2(r[2][1], r[1][1])


def to_quaternion(r: list[list[Scalar]], ops: Any) -> list[Scalar]:
    """Unit quaternion (w ≥ 0) of a rotation matrix, from its largest component, which is far from zero."""
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
