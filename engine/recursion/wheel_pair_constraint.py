"""Constraint of two wheels that roll on each other (theory, "Rolling"): no sliding at the contact.

k is the direction of the force between the wheels. v_in and v_out are the velocities of the parts at the contact; t_in and t_out
are pure torques. The rate of the row is k·(v_out − v_in) + t_out·ω_out + t_in·ω_in; ξ is the time derivative of this rate at Ż =
0."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import casadi as ca

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.joints.wheel_pairs import Sizes, phase, side
from trunnion.recursion.cut_joint_frames_and_rows import NOTHING, Cut, Moving, Row, force_row, point_velocity
from trunnion.recursion.symbolic_inputs import Symbols
from trunnion.recursion.vector_algebra import SX, cross, zeros
from trunnion.recursion.worm_constraint import Pitch, pitch

NO_LEAD = SX(0)
"""Lead angle of pairs without a worm."""


@dataclass
class WheelContact:
    """Contact of a wheel pair for a unit multiplier, as vectors with rates. push: force on the outboard part (norm 1, less for
    belts). arm_in, arm_out: arms of the force from the origins of both parts. torque_in, torque_out: torques on both."""

    push: Moving
    arm_in: Moving
    arm_out: Moving
    torque_in: Moving
    torque_out: Moving


Parting = tuple[tuple[Moving, Moving], tuple[Moving, Moving]]
"""Two pairs: axis of the relative rotation and direction in which the wheels separate; arms of a force along this direction from
the origins of both parts."""


def rolling_row(sym: Symbols, c: Cut) -> Row:
    """Constraint row of a cut joint whose two wheels roll on each other."""
    wheels, rolls = c.joint.wheels, c.joint.kind.rolls
    assert wheels is not None
    assert rolls is not None
    of = _sizes(sym, c)
    touch = TOUCHES[rolls.touch](c, *of.radii(rolls.touch, ca), of.lead)
    inb, out = ([[E[i, k] for i in range(3)] for k in range(3)] for E in (c.Ein, c.Eout))
    rolled = phase(rolls.touch, inb, out, [c.s[i] for i in range(3)], of, ca) - sym.leaf(wheels.phase)
    size = ca.cos(of.lead) if rolls.touch == "skew" else 1
    return _row(c, touch, 0.5 * of.module * size * ca.sin(rolled))


def _sizes(sym: Symbols, c: Cut) -> Sizes:
    wheels = c.joint.wheels
    assert wheels is not None
    lead = SX(0) if wheels.lead is None else sym.leaf(wheels.lead)
    return Sizes(sym.leaf(wheels.module), (sym.leaf(wheels.teeth[0]), sym.leaf(wheels.teeth[1])), lead)


def worm_frame(sym: Symbols, c: Cut) -> SX:
    """Joint frame of a worm: its axis, the direction to the wheel's axis, and their cross product."""
    at = _pitch(c, *_sizes(sym, c).radii("skew", ca))
    return ca.horzcat(at.a[0], at.u[0], at.w[0])


def _row(c: Cut, t: WheelContact, phi: SX) -> Row:
    return force_row(c, phi, t.push, t.arm_in, t.arm_out, t.torque_in, t.torque_out)


def rolling_freedoms(sym: Symbols, c: Cut) -> list[Row]:
    """Two freedoms, each as a ``Row`` of which only the rate, the wrenches and ξ are used. For toothed wheels, the first freedom
    is the relative rotation (for a worm, the motion along the thread), which makes the flanks slide; the second is the distance.
    For a belt that may slide, the freedoms are the sliding and half the change of the belt's length."""
    wheels, rolls = c.joint.wheels, c.joint.kind.rolls
    assert wheels is not None
    assert rolls is not None
    of = _sizes(sym, c)
    r1, r2 = of.radii(rolls.touch, ca)
    if c.joint.kind.slips:
        return [_row(c, touch, SX(0)) for touch in (_sliding(c, r1, r2), _strands(c, r1, r2))]
    if rolls.touch == "skew":
        at, lead = _pitch(c, r1, r2), SX(of.lead)
        return [at.row(c, SX(0), push) for push in (at.mixed(ca.sin(lead), ca.cos(lead)), at.u)]
    (turns, apart), (arm_in, arm_out) = APART[rolls.touch](c, r1, r2)
    turn = WheelContact(NOTHING, NOTHING, NOTHING, _times(SX(-1), turns), turns)
    return [_row(c, turn, SX(0)), _row(c, WheelContact(apart, arm_in, arm_out, NOTHING, NOTHING), SX(0))]


def _between(c: Cut) -> tuple[Moving, Moving, SX, SX]:
    """The vector s from the inboard to the outboard point, split with respect to the inboard axis. Returns four results: the
    component along the axis with its rate, the perpendicular component with its rate, the squared norm of the perpendicular
    component, and the rate of this square."""
    (a, adot), _ = _axes(c)
    sdot = point_velocity(c)
    h, hdot = ca.dot(c.s, a), ca.dot(sdot, a) + ca.dot(c.s, adot)
    along = (h * a, hdot * a + h * adot)
    p = (c.s - along[0], sdot - along[1])
    return along, p, ca.dot(p[0], p[0]), 2 * ca.dot(p[0], p[1])


def _axes(c: Cut) -> tuple[Moving, Moving]:
    """The axis e1 of the inboard and of the outboard joint frame, with rates."""
    a, b = c.Ein[:, 0], c.Eout[:, 0]
    return (a, cross(c.inb.omega, a)), (b, cross(c.out.omega, b))


def _arms(c: Cut) -> tuple[Moving, Moving]:
    """Vectors from the origin of each part to its joint point, with rates."""
    return (c.c_in, cross(c.inb.omega, c.c_in)), (c.c_out, cross(c.out.omega, c.c_out))


def _times(f: SX, v: Moving) -> Moving:
    return f * v[0], f * v[1]


def _plus(*all_of: Moving) -> Moving:
    return sum((v for v, _ in all_of), zeros(3)), sum((r for _, r in all_of), zeros(3))


def _crossed(a: Moving, b: Moving) -> Moving:
    return cross(a[0], b[0]), cross(a[1], b[0]) + cross(a[0], b[1])


def _wheels(c: Cut, r1: SX, r2: SX, lead: SX = NO_LEAD) -> WheelContact:
    """Contact of two wheels with parallel axes, in the plane of the inboard point. The force of a unit multiplier is perpendicular
    to the line of centres. Its norm is (r1 + r2)/distance: 1 for gears, less for belts."""
    (a, adot), _ = _axes(c)
    arm_in, arm_out = _arms(c)
    along, p, square, rate = _between(c)
    across = _crossed((a, adot), p)
    part = (r1 + r2) / square
    push = (part * across[0], part * (across[1] - rate / square * across[0]))
    return WheelContact(push, arm_in, _plus(arm_out, _times(SX(-1), along)), _times(-r1, (a, adot)), _times(-r2, (a, adot)))


def _sliding(c: Cut, r1: SX, r2: SX) -> WheelContact:
    """The row for a belt's sliding: plus or minus the row of the wheels for a unit force. The row is positive if the surface of the
    inboard pulley runs ahead in the sense of e1."""
    made, way = _wheels(c, r1, r2), ca.if_else(r1 < 0, 1.0, -1.0)
    push, torque_in, torque_out = (_times(way, v) for v in (made.push, made.torque_in, made.torque_out))
    return replace(made, push=push, torque_in=torque_in, torque_out=torque_out)


def _strands(c: Cut, r1: SX, r2: SX) -> WheelContact:
    """Two equal tensions, one in each strand of a belt, with the sum 1. Each strand is inclined to the line of centres by the angle
    whose sine is (r1 + r2)/distance."""
    arm_in, arm_out = _arms(c)
    along, p, square, rate = _between(c)
    inner = ca.sqrt(square - (r1 + r2) ** 2)
    part, partdot = inner / square, rate * (0.5 / (inner * square) - inner / square**2)
    push = (part * p[0], part * p[1] + partdot * p[0])
    return WheelContact(push, arm_in, _plus(arm_out, _times(SX(-1), along)), NOTHING, NOTHING)


def _wheels_apart(c: Cut, r1: SX, r2: SX) -> Parting:
    """Wheels with parallel axes rotate about their axes, and separate along the line of centres."""
    along, p, square, rate = _between(c)
    length = ca.sqrt(square)
    apart = (p[0] / length, p[1] / length - 0.5 * rate / (square * length) * p[0])
    arm_in, arm_out = _arms(c)
    return (_axes(c)[0], apart), (arm_in, _plus(arm_out, _times(SX(-1), along)))


def _cones_apart(c: Cut, r1: SX, r2: SX) -> Parting:
    """Bevel wheels rotate about the contact line. They separate perpendicular to this line in the plane of the axes, towards the
    outboard wheel."""
    a, b = _axes(c)
    n, touch = _crossed(a, b), _plus(_times(r2, a), _times(r1, b))
    line = _times(1 / ca.norm_2(touch[0]), touch)
    apart = _times(1 / ca.norm_2(n[0]), _crossed(n, line))
    own = _cones(c, r1, r2)
    return (line, apart), (own.arm_in, own.arm_out)


def _rack_apart(c: Cut, r: SX, _: SX) -> Parting:
    """A wheel and a rack rotate about the wheel's axis. They separate in the direction from the wheel to the rack."""
    a, b = _axes(c)
    one, two, between = ([v[i] for i in range(3)] for v in (a[0], b[0], c.s))
    own = _rack(c, r, _)
    return (a, _times(side(one, two, between, ca), _crossed(a, b))), (own.arm_in, own.arm_out)


def _cones(c: Cut, r1: SX, r2: SX, lead: SX = NO_LEAD) -> WheelContact:
    """Contact of two wheels whose axes meet at the joint's point. The contact lies where the pitch circles touch."""
    a, b = _axes(c)
    n = _crossed(a, b)
    sine = ca.norm_2(n[0])
    touch = _times(1 / sine, _plus(_times(r2, a), _times(r1, b)))
    arm_in, arm_out = (_plus(arm, touch) for arm in _arms(c))
    return WheelContact(_times(1 / sine, n), arm_in, arm_out, NOTHING, NOTHING)


def _rack(c: Cut, r: SX, _: SX, lead: SX = NO_LEAD) -> WheelContact:
    """Contact of a wheel and a rack, at the wheel's radius from its axis."""
    a, b = _axes(c)
    one, two, between = ([v[i] for i in range(3)] for v in (a[0], b[0], c.s))
    reach = _times(r * side(one, two, between, ca), _crossed(a, b))
    arm_in, arm_out = _arms(c)
    back = (-c.s, -point_velocity(c))
    return WheelContact(b, _plus(arm_in, reach), _plus(arm_out, back, reach), NOTHING, NOTHING)


def _worm(c: Cut, r1: SX, r2: SX, lead: SX) -> WheelContact:
    """Contact of a worm and its wheel, at the pitch point, across the thread."""
    at = _pitch(c, r1, r2)
    return WheelContact(at.mixed(ca.cos(lead), -ca.sin(lead)), at.arm_in, at.arm_out, NOTHING, NOTHING)


def _pitch(c: Cut, r1: SX, r2: SX) -> Pitch:
    return pitch(c, r1, r2, _axes(c), _crossed)


APART: dict[str, Callable[[Cut, SX, SX], Parting]] = {"wheels": _wheels_apart, "cones": _cones_apart, "straight": _rack_apart}
TOUCHES: dict[str, Callable[..., WheelContact]] = {"wheels": _wheels, "cones": _cones, "straight": _rack, "skew": _worm}
