"""Joint types: coordinates, motion axes, and the constraint rows of a cut joint.

The kinematic functions take scalars, either symbols or numbers. For example, ``rotation(q, ops)`` takes a sequence of scalars and a
namespace with ``sin`` and ``cos``, and returns a 3×3 nested list."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Literal

from trunnion.basics.lazy_data_classes import dataclass

Scalar = Any
Rotation = Callable[[Sequence[Scalar], Any], list[list[Scalar]]]


E1, E2, E3 = range(3)
"""The axes of a joint frame, by index."""


@dataclass(frozen=True, kw_only=True)
class Axis:
    """One column of the paper's (1), (2): of P^r if ``rot`` (a rotation), otherwise of P^s (a translation). The column is the unit
    vector ``index`` (E1, E2, E3) of the joint frame on ``side``. ``by_pitch``: whether the column is multiplied by pitch/2π; for a
    screw, whose ``travel`` assumes a pitch of 2π."""

    index: int
    rot: bool
    side: Literal["in", "out"] = "in"
    by_pitch: bool = False


def turn(index: int, side: Literal["in", "out"] = "in") -> Axis:
    """A rotation axis that is fixed in the frame of one side."""
    return Axis(index=index, rot=True, side=side)


def slide(index: int, by_pitch: bool = False) -> Axis:
    """A sliding axis that is fixed in the inboard frame."""
    return Axis(index=index, rot=False, by_pitch=by_pitch)


@dataclass(frozen=True, kw_only=True)
class Rolls:
    """Rolling of two parts without sliding.

    touch     "wheels" about parallel axes, "cones" about intersecting axes, "skew" for a worm and its wheel, or "straight" for a
              wheel and a rack
    wheels    number of wheels
    apart     whether the joint's two points are different (the wheels' centres); otherwise they coincide
    size      key of the tooth size in a scene; "radii" for wheels without teeth
    opposite  whether the wheels turn in opposite senses
    choice    key that reverses ``opposite``; "" if there is no such key
    """

    touch: Literal["wheels", "cones", "skew", "straight"]
    wheels: int = 2
    apart: bool = True
    size: Literal["module", "pitch", "radii"] = "module"
    opposite: bool = True
    choice: Literal["", "internal", "crossed"] = ""


def identity(q: Sequence[Scalar], ops: Any) -> list[list[Scalar]]:
    """R = E, for a joint without rotation."""
    return [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]


def no_travel(q: Sequence[Scalar]) -> list[Scalar]:
    """s = 0, for a joint without translation."""
    return [0.0, 0.0, 0.0]


@dataclass(frozen=True, kw_only=True)
class JointKind:
    """A joint type (paper §2, §4, §5). ``trunnion.elements.joints.declaration_checks`` checks the consistency of a declaration at
    import.

    name         name of the type in scenes.
    freedoms     the freedoms in words, in their order, for the published schema.
    axes         for every rate, the axes of its motion (a screw rate has two).
    coordinates  kind of each q: "angle", "length" or "quaternion" (four in a row, the last ones).
    rotation     (q, ops) → R (3×3), which maps components in the outboard joint frame to components in the inboard joint frame.
    travel       q → s = p_out − p_in, components along the inboard axes.
    rows_s       for a cut joint, the indices k of the translational constraints (r_out − r_in)·h_in^k = 0, (49).
    rows_r       for a cut joint, the pairs (m, k) of the rotational constraints h_in^m·h_out^k = 0, (46).
    ties         number of constraints that couple two coordinates (screw), and are neither (46) nor (49). A joint with ties cannot
                 be cut.
    measure      (R, s, ops) → q, the inverse of ``rotation`` and ``travel`` (angles within ±π).
    friction     name of the contact element of a frictional joint of this type; "" if there is none.
    contacts     number of contacts of this element.
    loaded       name of the contact element whose friction depends on the force or torque that the joint transmits along its only
                 freedom, e1; "" if the type has none.
    banded       name of the contact element of a band or belt around parts of the joint; "" if the type has none.
    rolls        for wheels that roll on each other (``elements.joints.wheel_pairs``). The joint carries no body and has one row.
    slips        whether the wheels may slide. The joint then has no row, and its first freedom is the sliding.
    follows      the follower (``elements.joints.cam_and_curve_followers``). A "point" or "face" of the outboard body follows a cam
                 of the inboard body. With "curve", a point follows a curve; with "freedom", a freedom follows another freedom. The
                 joint carries no body and has one row.
    plays        whether a point that follows a curve has play. The joint's row is then the gap to walls beside the curve and at its
                 ends.
    keeps_distance
                 whether the distance of the joint's two points is constant (rod). The joint carries no body and has one row.
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
    loaded: str = ""
    banded: str = ""
    rolls: Rolls | None = None
    slips: bool = False
    follows: Literal["", "point", "face", "curve", "freedom"] = ""
    plays: bool = False
    keeps_distance: bool = False

    @property
    def bodiless(self) -> bool:
        """Whether the joint carries no body, but couples parts that other joints carry."""
        return self.rolls is not None or bool(self.follows) or self.keeps_distance

    @property
    def pushes(self) -> bool:
        """Whether the multiplier of the single constraint row is a normal force, so that the contact may begin and end."""
        return self.follows in ("point", "face", "curve") or (self.rows_s == (E1,) and not self.rows_r)

    @property
    def apart(self) -> bool:
        """Whether the two points of the joint may be apart."""
        return self.rolls.apart if self.rolls else self.keeps_distance or bool(self.follows)

    @property
    def nq(self) -> int:
        """Number of coordinates q."""
        return len(self.coordinates)

    @property
    def nv(self) -> int:
        """Number of rates, which is the number of freedoms."""
        return len(self.axes)

    @property
    def rows(self) -> int:
        """Number of constraint rows of a cut joint."""
        return self.travels + len(self.rows_r)

    @property
    def travels(self) -> int:
        """Number of constraint rows with a residual in m. These rows are the first of ``rows``."""
        return len(self.rows_s) + (self.bodiless and not self.slips)

    @property
    def cuttable(self) -> bool:
        """Whether the rows (46) and (49) represent all constraints of the joint, so that the joint may be cut."""
        return self.ties == 0

    @property
    def quaternion(self) -> int:
        """Index in q of the quaternion's first entry; −1 without a quaternion."""
        return self.coordinates.index("quaternion") if "quaternion" in self.coordinates else -1

    @property
    def pitched(self) -> bool:
        """Whether a joint of this type has a pitch."""
        return any(a.by_pitch for axes in self.axes for a in axes)

    @property
    def needs_axis(self) -> bool:
        """Whether the joint needs the direction of e1. A joint that rotates about all axes or none, and slides along all axes or
        none, does not need this direction."""
        if self.bodiless:
            return not self.keeps_distance and self.follows != "freedom"
        return any(sum(a.rot == rot for axes in self.axes for a in axes) in (1, 2) for rot in (True, False))

    @property
    def second_axis(self) -> int:
        """Index of the outboard axis of a joint that rotates about an inboard and an outboard axis (universal); −1 for other
        joints."""
        return next((a.index for axes in self.axes for a in axes if a.side == "out"), -1)

    @property
    def turning(self) -> tuple[int, ...]:
        """Indices of the rotation axes, in the order of the rates."""
        return tuple(a.index for axes in self.axes for a in axes if a.rot)

    @property
    def slides_along(self) -> int:
        """Index of the axis of a joint whose first freedom is its only translation (a straight guide); −1 for other joints."""
        along = [k for k in range(self.nv) if not self.turns(k)]
        return self.axes[0][0].index if along == [0] else -1

    @property
    def freely_rubbed(self) -> tuple[bool, ...]:
        """For each freedom, whether it is a rotation. These flags determine the joint's element of constant friction. Empty if the
        joint cannot have constant friction."""
        free = 0 < self.nv <= 2 and self.quaternion < 0 and self.follows != "freedom"
        return tuple(self.turns(k) for k in range(self.nv)) if free else ()

    def turns(self, rate: int) -> bool:
        """Whether a freedom is a rotation (rad) and not a travel (m). The freedom of a screw counts as a rotation."""
        return self.axes[rate][0].rot

    def can_be_prescribed(self, rate: int) -> bool:
        """Whether a motion can be prescribed along the freedom with this rate."""
        return not self.bodiless and 0 <= rate < self.nv and self.coordinate_of(rate) >= 0

    def coordinate_of(self, rate: int) -> int:
        """Index in q of the coordinate whose derivative is this rate. −1 if there is none (quaternion, sliding along a cam)."""
        return rate if rate < (self.nq if self.quaternion < 0 else self.quaternion) else -1


def about_e1(angle: Scalar, ops: Any) -> list[list[Scalar]]:
    """The matrix of a rotation by an angle about e1."""
    c, s = ops.cos(angle), ops.sin(angle)
    return [[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]


def of_quaternion(e: Sequence[Scalar]) -> list[list[Scalar]]:
    """R of a quaternion, scalar first. The division by |e|² makes R a rotation even if the norm deviates from 1."""
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
    """Unit quaternion (w ≥ 0) of a rotation matrix. The formula divides by the largest component, which is at least 1/2."""
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
