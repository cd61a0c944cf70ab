"""Constraint of a cam follower (theory, "Cams"): a point of the follower stays on a curve of the cam, or a face touches the cam.

k is the contact normal. The rate of the row is k·(v_out − v_in), where v_out and v_in are the velocities of the parts at the
contact. ξ is the rate's time derivative at Ż = 0."""

from __future__ import annotations

import casadi as ca

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.recursion.cut_joint_frames_and_rows import Cut, Moving, Row, force_row, point_velocity
from trunnion.recursion.symbolic_inputs import Symbols
from trunnion.recursion.vector_algebra import SX, cross


@dataclass
class ProjectedVector:
    """Projection on the cam's plane of a vector v: the vector to the follower's point, or the normal of the follower's face.

    angle, length   polar coordinates of v in that plane (rad; m or 1), with rates.
    e2, e3          axes from which the angle is measured, world (3 each)."""

    angle: Moving
    length: Moving
    e2: SX
    e3: SX


def bearing(sym: Symbols, c: Cut) -> SX:
    """Angle of the vector of ``ProjectedVector`` in the cam's plane, rad, within ±π. The cam's curve is evaluated at this angle."""
    return _seen(sym, c).angle[0]


@dataclass
class FollowerContact:
    """Contact of a follower with a cam.

    phi               distance of the follower from the curve, m.
    n, t              unit vectors with rates: normal towards the follower, and sliding direction.
    arm_in, arm_out   arms of the contact force from the origins of both parts, with rates, m.
    frame             columns: the cam's axis, n, t (3×3)."""

    phi: SX
    n: Moving
    t: Moving
    arm_in: Moving
    arm_out: Moving
    frame: SX


def following_row(sym: Symbols, c: Cut) -> tuple[Row, Row, SX, SX]:
    """The constraint row, the freedom, the contact frame and ``inside_ends`` of a cut joint whose outboard part follows
    a cam.

    The freedom is sliding of the follower along the cam: a ``Row`` of which only the rate, the wrenches and ξ are used.
    The columns of the frame (3×3, world) are the cam's axis, the normal towards the follower and the sliding direction."""
    assert c.joint.profile is not None
    seen = _seen(sym, c)
    inside = sym.leaf(c.joint.profile.half) - ca.fabs(seen.angle[0])
    curve = sym.curve(c.joint, seen.angle[0])
    at = (_point if c.joint.kind.follows == "point" else _face)(sym, c, seen, curve)
    arms = at.arm_in, at.arm_out
    return force_row(c, at.phi, at.n, *arms), force_row(c, SX(0), at.t, *arms), at.frame, inside_ends(sym, c, inside, at.phi)


def inside_ends(sym: Symbols, c: Cut, inside: SX, phi: SX) -> SX:
    """A number that is positive where a part can touch a wall with free ends. inside: distance or angle inside the ends. phi: gap,
    m. Where the gap is below minus the wall's thickness, the part is behind the wall."""
    return ca.fmin(inside, phi + sym.leaf(c.joint.unilateral.thickness)) if c.joint.unilateral else inside


def _seen(sym: Symbols, c: Cut) -> ProjectedVector:
    assert c.joint.profile is not None
    cosine, sine = (sym.leaf(x) for x in c.joint.profile.middle)
    e2, e3 = cosine * c.Ein[:, 1] + sine * c.Ein[:, 2], cosine * c.Ein[:, 2] - sine * c.Ein[:, 1]
    w = c.inb.omega
    if c.joint.kind.follows == "point":
        v, rate = c.s, point_velocity(c) - cross(w, c.s)
    else:
        v = c.Eout[:, 0]
        rate = cross(c.out.omega - w, v)
    x, y, xdot, ydot = (ca.dot(e, of) for of in (v, rate) for e in (e2, e3))
    length = ca.sqrt(x * x + y * y)
    angle = (ca.atan2(y, x), (x * ydot - y * xdot) / (length * length))
    return ProjectedVector(angle, (length, (x * xdot + y * ydot) / length), e2, e3)


def _frame(c: Cut, seen: ProjectedVector, angle: Moving) -> tuple[Moving, Moving]:
    """n and t, each with its rate. angle: angle of n from ``seen.e2``."""
    a = c.Ein[:, 0]
    cosine, sine = ca.cos(angle[0]), ca.sin(angle[0])
    n, t = cosine * seen.e2 + sine * seen.e3, cosine * seen.e3 - sine * seen.e2
    turning = c.inb.omega + angle[1] * a
    return (n, cross(turning, n)), (t, cross(turning, t))


def _point(sym: Symbols, c: Cut, seen: ProjectedVector, curve: tuple[SX, SX, SX]) -> FollowerContact:
    """Contact of a point with the cam. The curve gives the distance of the point from the cam's axis as a function of the point's
    angle. Inside an internal cam, n points to the cam's axis. A roller around the point touches the cam at the position:
    point − radius · n."""
    (angle, turned), (length, spread), (r, slope, bend) = seen.angle, seen.length, curve
    square = length * length + slope * slope
    lean = (ca.atan2(slope, length), (bend * turned * length - slope * spread) / square)
    assert c.joint.profile is not None
    side, roller = sym.leaf(c.joint.profile.side), sym.leaf(c.joint.profile.roller)
    n, t = ((side * x, side * dx) for x, dx in _frame(c, seen, (angle - lean[0], turned - lean[1])))
    own, carried = (c.c_out, cross(c.out.omega, c.c_out)), c.out.rdot - c.inb.rdot
    arm_in = (c.c_in + c.s - roller * n[0], carried + own[1] - roller * n[1])
    arm_out = (own[0] - roller * n[0], own[1] - roller * n[1])
    # The residual is the radial deviation times the cosine of the pressure angle, taken at the curve. If the pressure angle were
    # taken at the point, cosine and residual would vanish for a point on the cam's axis.
    phi = side * (length - r) * r / ca.sqrt(r * r + slope * slope)
    return FollowerContact(phi, n, t, arm_in, arm_out, ca.horzcat(c.Ein[:, 0], n[0], t[0]))


def _face(sym: Symbols, c: Cut, seen: ProjectedVector, curve: tuple[SX, SX, SX]) -> FollowerContact:
    """Contact of a flat face with the cam. The curve gives the distance h of the face from the cam's axis as a function of the
    angle of the face's normal n. The contact point is h n + (dh/dangle) t from the axis."""
    (h, slope, bend), turned = curve, seen.angle[1]
    n, t = _frame(c, seen, seen.angle)
    foot = h * n[0] + slope * t[0]
    moved = slope * turned * n[0] + h * n[1] + bend * turned * t[0] + slope * t[1]
    own = c.c_in, cross(c.inb.omega, c.c_in)
    arm_in = (own[0] + foot, own[1] + moved)
    arm_out = (c.c_out - c.s + foot, own[1] + moved + c.inb.rdot - c.out.rdot)
    return FollowerContact(ca.dot(n[0], c.s) - h, n, t, arm_in, arm_out, ca.horzcat(c.Ein[:, 0], n[0], t[0]))
