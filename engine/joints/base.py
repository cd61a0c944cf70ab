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
    """One column of the matrix P^r (turning, ``rot``) or P^s (sliding) of the paper's (1), (2): unit vector ``index`` (E1, E2,
    E3) of the joint frame on ``side``. ``by_pitch``: the column is multiplied by pitch/2π (a screw's; its ``travel`` is
    likewise for a pitch of 2π)."""

    index: int
    rot: bool
    side: Literal["in", "out"] = "in"
    by_pitch: bool = False


def turn(index: int, side: Literal["in", "out"] = "in") -> Axis:
    """An axis to turn about, fixed in the frame of one side."""
    return Axis(index=index, rot=True, side=side)


def slide(index: int, by_pitch: bool = False) -> Axis:
    """An axis to slide along, fixed in the inboard frame."""
    return Axis(index=index, rot=False, by_pitch=by_pitch)


@dataclass(frozen=True, kw_only=True)
class Rolls:
    """How two parts roll on each other without sliding. touch: wheels about parallel axes, about axes that meet (cones), or a wheel
    and a rack; wheels: how many they are; apart: whether its two points are the middles of the wheels, not one place; size: what a
    scene says beside numbers of teeth; opposite: whether the wheels turn opposite ways, choice: the key that makes it the other
    way round ("" = none)."""

    touch: Literal["wheels", "cones", "straight"]
    wheels: int = 2
    apart: bool = True
    size: Literal["module", "pitch"] = "module"
    opposite: bool = True
    choice: Literal["", "internal", "crossed"] = ""


@dataclass(frozen=True, kw_only=True)
class JointKind:
    """A joint type (paper §2, §4, §5). ``engine.joints.contract`` says what must hold among its parts; a type that breaks it
    cannot be imported.

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
    rolls        of two wheels that roll on each other (``joints.rolling``): such a joint carries no body, and has one row.
    follows      what of the outboard part follows a curve around the inboard one ("curve": a point any curve in its plane), or a
                 freedom that another joint's follows (``joints.following``): likewise.
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
    rolls: Rolls | None = None
    follows: Literal["", "point", "face", "curve", "freedom"] = ""

    @property
    def bodiless(self) -> bool:
        """Whether it only ties parts that other joints carry."""
        return self.rolls is not None or bool(self.follows)

    @property
    def apart(self) -> bool:
        """Whether its two points are on two parts that touch elsewhere, not one place."""
        return self.rolls.apart if self.rolls else self.follows in ("point", "face", "curve")

    @property
    def nq(self) -> int:
        """Number of coordinates q."""
        return len(self.coordinates)

    @property
    def nv(self) -> int:
        """Number of rates, which is that of the freedoms."""
        return len(self.axes)

    @property
    def rows(self) -> int:
        """Number of constraint rows the joint gives when it is cut."""
        return self.travels + len(self.rows_r)

    @property
    def travels(self) -> int:
        """How many of these rows hold a travel, in m; they come first."""
        return len(self.rows_s) + self.bodiless

    @property
    def cuttable(self) -> bool:
        """Whether rows (46) and (49) express all its constraints."""
        return self.ties == 0

    @property
    def quaternion(self) -> int:
        """Index in q where the quaternion starts, −1 when the type has none."""
        return self.coordinates.index("quaternion") if "quaternion" in self.coordinates else -1

    @property
    def pitched(self) -> bool:
        """Whether a joint of this type has a pitch."""
        return any(a.by_pitch for axes in self.axes for a in axes)

    @property
    def needs_axis(self) -> bool:
        """Whether it matters which way e1 points. It does not for a type that turns about all axes or none, and slides along
        all or none."""
        scarce = (sum(a.rot == rot for axes in self.axes for a in axes) in (1, 2) for rot in (True, False))
        return self.bodiless or any(scarce)

    @property
    def second_axis(self) -> int:
        """Index of the outboard axis the joint turns about besides an inboard one (two crossed pins), −1 when it has none."""
        return next((a.index for axes in self.axes for a in axes if a.side == "out"), -1)

    @property
    def turning(self) -> tuple[int, ...]:
        """Indices of the axes the joint turns about, in the order of the rates."""
        return tuple(a.index for axes in self.axes for a in axes if a.rot)

    @property
    def slides_along(self) -> int:
        """Index of the one axis the joint slides along by its first rate (a straight guide has one), −1 when there is none."""
        along = [k for k in range(self.nv) if not self.turns(k)]
        return self.axes[0][0].index if along == [0] else -1

    @property
    def freely_rubbed(self) -> tuple[bool, ...]:
        """Whether each of its freedoms turns, for friction that acts along each of them by itself; () where none does."""
        return tuple(self.turns(k) for k in range(self.nv)) if 0 < self.nv <= 2 and self.quaternion < 0 else ()

    def turns(self, rate: int) -> bool:
        """Whether a freedom is a rotation, in rad (a screw's is), not a travel, in m."""
        return self.axes[rate][0].rot

    def coordinate_of(self, rate: int) -> int:
        """Index in q whose time derivative is this rate, −1 for rates of a quaternion and of what slides along a curve."""
        return rate if rate < (self.nq if self.quaternion < 0 else self.quaternion) else -1


def identity(q: Sequence[Scalar], ops: Any) -> list[list[Scalar]]:
    """The rotation of a joint that does not turn: R = E."""
    return [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]


def no_travel(q: Sequence[Scalar]) -> list[Scalar]:
    """The travel of a joint that does not slide: s = 0."""
    return [0.0, 0.0, 0.0]


def about_e1(angle: Scalar, ops: Any) -> list[list[Scalar]]:
    """The rotation by an angle about e1."""
    c, s = ops.cos(angle), ops.sin(angle)
    return [[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]


def of_quaternion(e: Sequence[Scalar]) -> list[list[Scalar]]:
    """R of a quaternion, scalar first. Divides by |e|², so that a quaternion slightly off unit length still gives a rotation."""
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
    """Unit quaternion (w ≥ 0) of a rotation matrix, computed from its largest component, which is safely away from zero."""
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
