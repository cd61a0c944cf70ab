"""Parts of one function each, built from the functions by which whole scenes are compiled: signals, loads,
energies, pins, rates of coordinates."""

from __future__ import annotations

from functools import cache
from typing import Any

import casadi as ca

from engine.basics.curves import KNOTS
from engine.contact import REGISTRY as CONTACTS
from engine.contact.base import OVERLAP
from engine.joints import REGISTRY
from engine.joints.base import quaternion_rate, to_quaternion
from engine.kernel.classes import unpack_motion
from engine.kernel.records import MOTION
from engine.parts.known import POSE, Numbers, Part
from engine.parts.local import PartSymbols, a_body
from engine.parts.one import one
from engine.recursion import bushings
from engine.recursion.kinematics import Motion, Step
from engine.recursion.loads import mass_matrix, spring_line, wrenches
from engine.recursion.reactions import overlap, pin_wrench
from engine.recursion.symbols import Symbols
from engine.recursion.vectors import SX, cross, zeros
from engine.system.external import TIMES
from engine.system.profiles import MOVES
from engine.system.structure import Body, Fit, Joint, Load, Signal

LEAVES = {"value": 1, "through": 2 * KNOTS, "ramp": 5, "begun": 5, "harmonic": 4, "rate": 2, **dict.fromkeys(MOVES, 4)}
"""Numbers of a signal, by its kind; a table has none."""


class Timed(PartSymbols):
    """With the moment of evaluation."""

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
def signal(kind: str, moves: bool) -> Part:
    """numbers, moment → value of a signal; of one that moves a drive its rate and acceleration too."""
    count = Numbers()
    s = Signal(kind, count.some(LEAVES[kind]))
    sym = Timed(count.count)
    out = ca.vertcat(*Symbols.motion(sym, s)) if moves else Symbols.load(sym, s)
    ins = {"numbers": sym.p, "x": sym.x} | ({"u": sym.u} if kind == "through" else {})
    return one(f"s_{kind}_{'motion' if moves else 'load'}", ins, {"out": out})


@cache
def load(kind: str, body_frame: bool, what: str) -> Part:
    """Of a force or torque on a body: motion, point (3), value (3) → ``wrench`` (6, added) or ``power`` (added)."""
    sym, motion = Timed(3), SX.sym("motion", MOTION)
    value = SX.sym("value", 3)
    sym.load = lambda s: value[s.index]  # type: ignore[method-assign]
    given = Load("", kind, (0,), (Numbers().some(3),), body_frame, tuple(Signal("value", (), k) for k in range(3)))
    m = unpack_motion(ca.vertsplit(motion))
    w = wrenches(sym, [m], given)[0][1]
    out = w if what == "wrench" else ca.dot(w[:3], m.rdot) + ca.dot(w[3:], m.omega)
    name = f"l_{kind}_{'body' if body_frame else 'world'}_{what}"
    return one(name, {"numbers": sym.p, "motion": motion, "value": value}, {"out": out}, ["out"])


@cache
def spring(what: str) -> Part:
    """Of a spring-damper between two points: numbers (3, points 3 + 3), two motions → ``wrench`` on both (6 each, added), ``power``
    of its damper or ``potential`` energy (added), or ``line``: its length, the force with which it pulls, its power (3)."""
    count = Numbers()
    numbers = count.some(3)
    points = (count.some(3), count.some(3))
    sym, a, b = Timed(count.count), SX.sym("a", MOTION), SX.sym("b", MOTION)
    given, motions = Load("", "spring_damper", (0, 1), points, numbers=numbers), [unpack_motion(ca.vertsplit(m)) for m in (a, b)]
    ins = {"numbers": sym.p, "a": a, "b": b}
    length, rate = spring_line(sym, motions, given)[:2]
    if what == "line":
        force = sym.p[0] * (length - sym.p[2]) + sym.p[1] * rate
        return one("l_spring_line", ins, {"out": [length, force, -force * rate]})
    if what == "wrench":
        (_, on_a), (_, on_b) = wrenches(sym, motions, given)
        return one("l_spring_wrench", ins, {"on_a": on_a, "on_b": on_b}, ["on_a", "on_b"])
    out = -sym.p[1] * rate**2 if what == "power" else 0.5 * sym.p[0] * (length - sym.p[2]) ** 2
    return one(f"l_spring_{what}", ins, {"out": out}, ["out"])


@cache
def bushing(what: str) -> Part:
    """Of a bushing: numbers (12, points 3 + 3, frames 9 + 9), two motions → ``wrench`` on both (6 each, added), ``power`` of its
    damping or ``potential`` energy (added), or its ``state``: offset, turn, force, torque, power (13)."""
    count = Numbers()
    numbers, points, frames = count.some(12), (count.some(3), count.some(3)), (count.some(9), count.some(9))
    sym, a, b = Timed(count.count), SX.sym("a", MOTION), SX.sym("b", MOTION)
    given: Any = Load("", "bushing", (0, 1), points, numbers=numbers, frames=frames)  # type: ignore[arg-type]
    found = bushings.bushing(sym, [unpack_motion(ca.vertsplit(m)) for m in (a, b)], given)
    ins = {"numbers": sym.p, "a": a, "b": b}
    if what == "wrench":
        (_, on_a), (_, on_b) = bushings.wrenches_of(found, given)
        return one("l_bushing_wrench", ins, {"on_a": on_a, "on_b": on_b}, ["on_a", "on_b"])
    if what == "state":
        return one("l_bushing_state", ins, {"out": ca.vertcat(found.offset, found.turn, found.force, found.torque, found.power)})
    return one(f"l_bushing_{what}", ins, {"out": found.taken if what == "power" else found.potential}, ["out"])


@cache
def energies() -> Part:
    """numbers of a body (mass, centre 3, inertia 6), gravity (3), motion → its kinetic and potential energy (added)."""
    count = Numbers()
    body: Body = a_body(count)
    sym, motion, g = PartSymbols(count.count), SX.sym("motion", MOTION), SX.sym("g", 3)
    m: Motion = unpack_motion(ca.vertsplit(motion))
    mass = mass_matrix(sym, body, m.R)
    p = mass.M11 @ m.rdot + mass.M12 @ m.omega
    kinetic = 0.5 * (ca.dot(m.rdot, p) + ca.dot(m.omega, mass.M12.T @ m.rdot + mass.M22 @ m.omega))
    potential = -sym.leaf(body.mass) * ca.dot(g, m.r + m.R @ sym.leaves(body.center))
    return one("b_energies", {"numbers": sym.p, "g": g, "motion": motion}, {"out": [kinetic, potential]}, ["out"])


def pinned_by(kind: str, forward: bool, fit: Fit, needs: tuple[str, ...], N: SX) -> tuple[dict[str, SX], SX]:
    """Symbols of a joint's pose (and of the lengths of parts that overlap), and the needed components of f_c, m_c as they follow
    from the reaction N (6) on its child."""
    pose, none = SX.sym("pose", POSE), zeros(3)
    Ein, Eout, s = ca.reshape(pose[:9], 3, 3), ca.reshape(pose[9:18], 3, 3), pose[18:]
    joint = Joint("", kind, 0, 0, (), (), (), (), fit, None, (), None, False, 0, forward)
    ins = {"pose": pose} | ({"lengths": SX.sym("lengths", 2)} if fit.ends == OVERLAP else {})
    return ins, pin_wrench(Step(joint, Ein, Eout, s, [], none, none, none, [], []), joint, N, needs, ins.get("lengths"))


@cache
def span() -> Part:
    """Pose, lengths of the inboard and the outboard part (2) → half the length over which they overlap."""
    pose, both = SX.sym("pose", POSE), SX.sym("lengths", 2)
    return one("r_span", {"pose": pose, "lengths": both}, {"out": overlap(pose[18:], ca.reshape(pose[:9], 3, 3), both)[1]})


@cache
def pin(kind: str, forward: bool, fit: Fit, needs: tuple[str, ...]) -> Part:
    """Reaction N on the child (6), pose (and lengths of parts that overlap) → the needed components of f_c, m_c; 0 for the span."""
    N = SX.sym("N", 6)
    ins, out = pinned_by(kind, forward, fit, needs, N)
    words = [CONTACTS[REGISTRY[kind].friction].name, "out" if forward else "in", fit.label, *needs]
    return one("_".join(["r", *words]), {"N": N, **ins}, {"out": out})


@cache
def along(kind: str, forward: bool, k: int) -> Part:
    """What a joint transmits along freedom k on its outboard part: N on the child (6), pose, pitch → one number."""
    N, pose, pitch = SX.sym("N", 6), SX.sym("pose", POSE), SX.sym("pitch")
    Ein, Eout, s = ca.reshape(pose[:9], 3, 3), ca.reshape(pose[9:18], 3, 3), pose[18:]
    f, t = N[:3], N[3:]
    if not forward:
        f, t = -f, -(t - cross(s, f))
    total = SX(0)
    for a in REGISTRY[kind].axes[k]:
        h = (Ein if a.side == "in" else Eout)[:, a.index]
        total += ca.dot(t, h) if a.rot else (pitch / (2 * ca.pi) if a.by_pitch else 1) * ca.dot(f, h)
    return one(f"r_along_{kind}_{'out' if forward else 'in'}_{k}", {"N": N, "pose": pose, "pitch": pitch}, {"out": total})


@cache
def at_least() -> Part:
    """A value, or what it is not to be below."""
    value, least = SX.sym("value"), SX.sym("least")
    return one("s_at_least", {"value": value, "least": least}, {"out": ca.fmax(value, least)})


@cache
def quaternion() -> Part:
    """Quaternion (4), turning rates (3) → its rate."""
    q, spin = SX.sym("q", 4), SX.sym("spin", 3)
    rate = quaternion_rate([q[i] for i in range(4)], [spin[k] for k in range(3)])
    return one("q_quaternion", {"q": q, "spin": spin}, {"out": rate})


@cache
def point() -> Part:
    """Motion of a body, a point of it (3) → its position and velocity (6)."""
    motion, p = SX.sym("motion", MOTION), SX.sym("p", 3)
    m = unpack_motion(ca.vertsplit(motion))
    lever = m.R @ p
    return one("o_point", {"motion": motion, "p": p}, {"out": ca.vertcat(m.r + lever, m.rdot + cross(m.omega, lever))})


@cache
def acceleration() -> Part:
    """Motion, point (3), gravity (3), Ż (6) → acceleration of a point of a body (3)."""
    motion, p, g, Z = SX.sym("motion", MOTION), SX.sym("p", 3), SX.sym("g", 3), SX.sym("Z", 6)
    m = unpack_motion(ca.vertsplit(motion))
    c = m.R @ p
    out = Z[:3] + cross(Z[3:], c) + cross(m.omega, cross(m.omega, c)) + g
    return one("o_acceleration", {"motion": motion, "p": p, "g": g, "Z": Z}, {"out": out})


@cache
def orientation() -> Part:
    """Motion → the quaternion of a body's orientation (4)."""
    motion = SX.sym("motion", MOTION)
    R = unpack_motion(ca.vertsplit(motion)).R
    return one("o_orientation", {"motion": motion}, {"out": to_quaternion([[R[r, c] for c in range(3)] for r in range(3)], ca)})


@cache
def over() -> Part:
    """One number over another."""
    a, b = SX.sym("a"), SX.sym("b")
    return one("o_over", {"a": a, "b": b}, {"out": a / b})

