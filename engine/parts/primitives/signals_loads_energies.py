"""Primitives of signals, loads, energies, reaction components and single numbers."""

from __future__ import annotations

from functools import cache
from typing import Any

import casadi as ca

from trunnion.basics.monotone_curves import KNOTS
from trunnion.elements.contact import REGISTRY as CONTACTS
from trunnion.elements.contact.contact_element import OVERLAP
from trunnion.elements.joints import REGISTRY
from trunnion.elements.joints.joint_kind import quaternion_rate
from trunnion.kernel.interface.runtime_tables import MOTION
from trunnion.kernel.units.motion_and_inertia_packing import unpack_motion
from trunnion.parts.primitives.primitive_from_expressions import expression_primitive
from trunnion.parts.primitives.primitive_keys import POSE, ParameterCounter, Primitive
from trunnion.parts.primitives.primitive_symbols import PrimitiveSymbols, a_body
from trunnion.recursion import bushing_forces
from trunnion.recursion.body_kinematics import Motion, Step
from trunnion.recursion.joint_reactions import overlap, pin_wrench
from trunnion.recursion.masses_and_forces import line_of, mass_matrix, wrenches
from trunnion.recursion.symbolic_inputs import Symbols
from trunnion.recursion.vector_algebra import SX, cross, zeros
from trunnion.scene.signals.registry import REGISTRY as SIGNALS
from trunnion.scene.signals.time_formulas import operate
from trunnion.system.structure.bodies_and_joints import Body, Fit, Joint, Load, Signal
from trunnion.system.structure.external_value_layout import TIMES

LEAVES = {"value": 1, "through": 2 * KNOTS} | {label: count for kind in SIGNALS.values() for label, count in kind.labels.items()}
"""Number of parameters of a signal, by kind. A table has no parameters. The parameters of limits and expressions belong to the
primitives ``limit`` and ``operation``."""


class Timed(PrimitiveSymbols):
    """Symbols of a primitive that depends on time."""

    def __init__(self, numbers: int):
        super().__init__(numbers)
        self.x = SX.sym("x", TIMES)
        self.t, self.ts = self.x[0], self.x[1]
        self.flags, self.u = SX.sym("flags", 2), SX.sym("u")

    def stop_flag(self, index: int) -> SX:
        return self.flags[index]

    def given(self, index: int) -> SX:
        return self.u


@cache
def signal(kind: str, moves: bool) -> Primitive:
    """Primitive of a signal. Inputs: numbers, time. Output: the signal's value; with ``moves``, also the rate and the
    acceleration."""
    count = ParameterCounter()
    s = Signal(kind, count.take(LEAVES[kind]))
    sym = Timed(count.count)
    out = ca.vertcat(*Symbols.motion(sym, s)) if moves else Symbols.load(sym, s)
    ins = {"numbers": sym.p, "x": sym.x} | ({"u": sym.u} if kind == "through" else {})
    return expression_primitive(f"s_{kind}_{'motion' if moves else 'load'}", ins, {"out": out})


@cache
def limit() -> Primitive:
    """Primitive of a limit. Inputs: lower and upper limit, value u. Output: the limited value."""
    sym, u = PrimitiveSymbols(2), SX.sym("u")
    return expression_primitive("s_limit", {"numbers": sym.p, "u": u}, {"out": ca.fmax(sym.p[0], ca.fmin(sym.p[1], u))})


@cache
def operation(what: str, order: int) -> Primitive:
    """Primitive of an operation in a formula of time (``scene.signals.time_formulas``). Inputs: the operands, each with ``order``
    values. Output: the result of the operation."""
    a, b = SX.sym("a", order), SX.sym("b", order)
    ins = {"a": a, "b": b} if what in ("+", "-", "*", "/") else {"a": a}
    name = {"+": "add", "-": "subtract", "*": "multiply", "/": "divide"}.get(what, what)
    return expression_primitive(f"s_{name}_{order}", ins, {"out": operate(what, *(ca.vertsplit(x) for x in ins.values()))})


@cache
def time() -> Primitive:
    """Input: time. Output: t and its first two derivatives by time."""
    x = SX.sym("x", TIMES)
    return expression_primitive("s_time", {"x": x}, {"out": [x[0], SX(1), SX(0)]})


@cache
def load(kind: str, body_frame: bool, what: str) -> Primitive:
    """Primitive of a force or torque on a body. Inputs: numbers (point 3), motion, value (3). The primitive adds the ``wrench`` (6)
    or the ``power`` of the load to the output."""
    sym, motion = Timed(3), SX.sym("motion", MOTION)
    value = SX.sym("value", 3)
    sym.load = lambda s: value[s.index]  # type: ignore[method-assign]
    given = Load("", kind, (0,), (ParameterCounter().take(3),), body_frame, tuple(Signal("value", (), k) for k in range(3)))
    m = unpack_motion(ca.vertsplit(motion))
    w = wrenches(sym, [m], given)[0][1]
    out = w if what == "wrench" else ca.dot(w[:3], m.rdot) + ca.dot(w[3:], m.omega)
    name = f"l_{kind}_{'body' if body_frame else 'world'}_{what}"
    return expression_primitive(name, {"numbers": sym.p, "motion": motion, "value": value}, {"out": out}, ["out"])


@cache
def place() -> Primitive:
    """Primitive of a point. Inputs: the point (3), motion of the point's body. Output: position of the point."""
    sym, motion = PrimitiveSymbols(3), SX.sym("motion", MOTION)
    m = unpack_motion(ca.vertsplit(motion))
    return expression_primitive("l_place", {"numbers": sym.p, "motion": motion}, {"out": m.r + m.R @ sym.p})


@cache
def spring(what: str) -> Primitive:
    """Primitive of a spring-damper. Inputs: numbers (3, points 3 + 3), motions of two bodies. The primitive adds one quantity
    (``what``) to the output: the ``wrench`` on both bodies (6 each), the ``power`` of the damper, or the ``potential`` energy."""
    count = ParameterCounter()
    numbers = count.take(3)
    points = (count.take(3), count.take(3))
    sym, a, b = Timed(count.count), SX.sym("a", MOTION), SX.sym("b", MOTION)
    given, motions = Load("", "spring_damper", (0, 1), points, numbers=numbers), [unpack_motion(ca.vertsplit(m)) for m in (a, b)]
    ins = {"numbers": sym.p, "a": a, "b": b}
    line = line_of(sym, motions, given)
    if what == "wrench":
        (_, on_a), (_, on_b) = wrenches(sym, motions, given)
        return expression_primitive("l_spring_wrench", ins, {"on_a": on_a, "on_b": on_b}, ["on_a", "on_b"])
    out = -sym.p[1] * line.rate**2 if what == "power" else 0.5 * sym.p[0] * (line.length - sym.p[2]) ** 2
    return expression_primitive(f"l_spring_{what}", ins, {"out": out}, ["out"])


@cache
def bushing(what: str) -> Primitive:
    """Primitive of a bushing. Inputs: numbers (12, points 3 + 3, frames 9 + 9), motions of two bodies. The primitive adds one
    quantity (``what``) to the output: the ``wrench`` on both bodies (6 each), the ``power`` of the damping, or the ``potential``
    energy."""
    count = ParameterCounter()
    numbers, points, frames = count.take(12), (count.take(3), count.take(3)), (count.take(9), count.take(9))
    sym, a, b = Timed(count.count), SX.sym("a", MOTION), SX.sym("b", MOTION)
    given: Any = Load("", "bushing", (0, 1), points, numbers=numbers, frames=frames)  # type: ignore[arg-type]
    found = bushing_forces.bushing(sym, [unpack_motion(ca.vertsplit(m)) for m in (a, b)], given)
    ins = {"numbers": sym.p, "a": a, "b": b}
    if what == "wrench":
        (_, on_a), (_, on_b) = bushing_forces.wrenches_of(found, given)
        return expression_primitive("l_bushing_wrench", ins, {"on_a": on_a, "on_b": on_b}, ["on_a", "on_b"])
    return expression_primitive(f"l_bushing_{what}", ins, {"out": found.taken if what == "power" else found.potential}, ["out"])


@cache
def energies() -> Primitive:
    """Primitive of a body's energies. Inputs: numbers of the body (mass, centre 3, inertia 6), gravity (3), motion. The primitive
    adds kinetic and potential energy to the output."""
    count = ParameterCounter()
    body: Body = a_body(count)
    sym, motion, g = PrimitiveSymbols(count.count), SX.sym("motion", MOTION), SX.sym("g", 3)
    m: Motion = unpack_motion(ca.vertsplit(motion))
    mass = mass_matrix(sym, body, m.R)
    p = mass.M11 @ m.rdot + mass.M12 @ m.omega
    kinetic = 0.5 * (ca.dot(m.rdot, p) + ca.dot(m.omega, mass.M12.T @ m.rdot + mass.M22 @ m.omega))
    potential = -sym.leaf(body.mass) * ca.dot(g, m.r + m.R @ sym.leaves(body.center))
    return expression_primitive("b_energies", {"numbers": sym.p, "g": g, "motion": motion}, {"out": [kinetic, potential]}, ["out"])


def pin_components(kind: str, forward: bool, fit: Fit, needs: tuple[str, ...], N: SX) -> tuple[dict[str, SX], SX]:
    """(inputs, components). Inputs, by name: symbols of a joint's pose and, if the joint's parts overlap, of the parts' lengths.
    Components: ``needs`` of f_c and m_c, as expressions of the inputs and of the reaction N (6) on the joint's child."""
    pose, none = SX.sym("pose", POSE), zeros(3)
    Ein, Eout, s = ca.reshape(pose[:9], 3, 3), ca.reshape(pose[9:18], 3, 3), pose[18:]
    joint = Joint("", kind, 0, 0, (), (), (), (), fit, None, (), None, False, 0, forward)
    ins = {"pose": pose} | ({"lengths": SX.sym("lengths", 2)} if fit.ends == OVERLAP else {})
    return ins, pin_wrench(Step(joint, Ein, Eout, s, [], none, none, none, [], []), joint, N, needs, ins.get("lengths"))


@cache
def span() -> Primitive:
    """Primitive of an overlap. Inputs: pose, lengths of the inboard and outboard part (2). Output: half the length of the
    overlap."""
    pose, both = SX.sym("pose", POSE), SX.sym("lengths", 2)
    return expression_primitive(
        "r_span", {"pose": pose, "lengths": both}, {"out": overlap(pose[18:], ca.reshape(pose[:9], 3, 3), both)[1]}
    )


@cache
def pin(kind: str, forward: bool, fit: Fit, needs: tuple[str, ...]) -> Primitive:
    """Primitive of the pin's wrench. Inputs: reaction N on the child (6), pose (and lengths of overlapping parts). Output: the
    components ``needs`` of f_c and m_c. The entry of the span, if any, is 0."""
    N = SX.sym("N", 6)
    ins, out = pin_components(kind, forward, fit, needs, N)
    words = [CONTACTS[REGISTRY[kind].friction].name, "out" if forward else "in", fit.label, *needs]
    return expression_primitive("_".join(["r", *words]), {"N": N, **ins}, {"out": out})


@cache
def along(kind: str, forward: bool, k: int) -> Primitive:
    """Primitive of a transmitted force. Inputs: N on the child (6), pose, pitch. Output: the force along freedom k that a joint
    transmits to its outboard part."""
    N, pose, pitch = SX.sym("N", 6), SX.sym("pose", POSE), SX.sym("pitch")
    Ein, Eout, s = ca.reshape(pose[:9], 3, 3), ca.reshape(pose[9:18], 3, 3), pose[18:]
    f, t = N[:3], N[3:]
    if not forward:
        f, t = -f, -(t - cross(s, f))
    total = SX(0)
    for a in REGISTRY[kind].axes[k]:
        h = (Ein if a.side == "in" else Eout)[:, a.index]
        total += ca.dot(t, h) if a.rot else (pitch / (2 * ca.pi) if a.by_pitch else 1) * ca.dot(f, h)
    return expression_primitive(
        f"r_along_{kind}_{'out' if forward else 'in'}_{k}", {"N": N, "pose": pose, "pitch": pitch}, {"out": total}
    )


@cache
def at_least() -> Primitive:
    """Primitive of a lower limit. Inputs: value, least. Output: max(value, least)."""
    value, least = SX.sym("value"), SX.sym("least")
    return expression_primitive("s_at_least", {"value": value, "least": least}, {"out": ca.fmax(value, least)})


@cache
def quaternion() -> Primitive:
    """Primitive of a quaternion's rate. Inputs: quaternion (4), angular rates (3). Output: rate of the quaternion."""
    q, spin = SX.sym("q", 4), SX.sym("spin", 3)
    rate = quaternion_rate([q[i] for i in range(4)], [spin[k] for k in range(3)])
    return expression_primitive("q_quaternion", {"q": q, "spin": spin}, {"out": rate})


@cache
def over() -> Primitive:
    """Inputs: a, b. Output: a/b."""
    a, b = SX.sym("a"), SX.sym("b")
    return expression_primitive("o_over", {"a": a, "b": b}, {"out": a / b})
