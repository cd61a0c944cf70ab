"""Parts of a body whose accelerations are known: what the balance of each body and joint is made of, each function by itself, so
that it has a tangent (``tangents``).

``work`` of a body here: its lever (3), the columns of Π of its free freedoms where they are not empty, w (6)."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import casadi as ca

from engine.joints import REGISTRY
from engine.kernel.classes import pack_motion, unpack_motion
from engine.kernel.records import MOTION
from engine.parts.known import Carried, Numbers, Part
from engine.parts.local import PartSymbols, a_body, a_joint
from engine.parts.one import one
from engine.recursion.kinematics import Motion, Step, walk
from engine.recursion.loads import mass_matrix, velocity_force
from engine.recursion.vectors import SX, Gamma, GammaT


def _walked(which: Carried) -> tuple[PartSymbols, SX, Motion, Step]:
    """Symbols of a body's joint and of the motion of the body that carries it, and what follows from them."""
    kind, count = REGISTRY[which.kind], Numbers()
    joint = a_joint(count, which.kind, which.forward, which.driven, kind.pitched, kind.nv)
    a_body(count)
    sym, carrier = PartSymbols(count.count, kind), SX.sym("carrier", MOTION)
    motion, step = walk(sym, joint, unpack_motion(ca.vertsplit(carrier)))
    return sym, carrier, motion, step


def _named(which: Carried, what: str) -> str:
    return f"i{which.name}_{what}"


@cache
def outward(which: Carried) -> Part:
    """numbers, coordinates, rates and prescribed accelerations of its joint, motion of the body that carries it → motion, pose,
    work."""
    sym, carrier, motion, step = _walked(which)
    ins = {"numbers": sym.p, "q": sym.q, "v": sym.v, "known": sym.known, "carrier": carrier}
    pose = ca.vertcat(ca.vec(ca.densify(step.Ein)), ca.vec(ca.densify(step.Eout)), ca.densify(step.s))
    columns = ca.vec(step.Pi)
    own = ca.vertcat(ca.densify(step.lever), columns[columns.sparsity().row()], ca.densify(step.w))
    made = one(_named(which, "outward"), ins, {"motion": pack_motion(motion), "pose": pose, "work": own})
    return replace(made, sizes={"work": int(own.numel())})


def _kept(which: Carried) -> tuple[SX, SX, SX, SX]:
    """Symbols of work: all of it, lever, Π, w."""
    pattern = _walked(which)[3].Pi.sparsity()
    all_of = SX.sym("work", 9 + pattern.nnz())
    return all_of, all_of[:3], SX(pattern, all_of[3:-6]), all_of[-6:]


@cache
def moved(which: Carried) -> Part:
    """work, Ż of the inboard body, q̈ of the free freedoms → Ż."""
    all_of, lever, Pi, w = _kept(which)
    Z, a = SX.sym("Z", 6), SX.sym("a", Pi.size2())
    return one(_named(which, "moved"), {"work": all_of, "Z": Z, "qdd": a}, {"Zo": Gamma(lever, Z) + Pi @ a + w})


@cache
def carry(which: Carried) -> Part:
    """work, reaction on the body (6) → what it is on the inboard body, added."""
    all_of, lever, _, _ = _kept(which)
    N = SX.sym("N", 6)
    return one(_named(which, "carry"), {"work": all_of, "N": N}, {"up": GammaT(lever, N)}, ["up"])


@cache
def turned(which: Carried) -> Part:
    """work, reaction on the body (6) → what it is on the inboard body and along the free freedoms, taken away."""
    all_of, lever, Pi, _ = _kept(which)
    N = SX.sym("N", 6)
    return one(_named(which, "turned"), {"work": all_of, "N": N}, {"up": -GammaT(lever, N), "along": -(Pi.T @ N)}, ["up", "along"])


@cache
def weigh(sign: int) -> Part:
    """numbers of a body (mass, centre 3, inertia 6), its motion, what acts on it besides (6), Ż → M Ż − F, times sign, added."""
    count = Numbers()
    body = a_body(count)
    sym, motion = PartSymbols(count.count), SX.sym("motion", MOTION)
    force, Z = SX.sym("force", 6), SX.sym("Z", 6)
    m = unpack_motion(ca.vertsplit(motion))
    mass = mass_matrix(sym, body, m.R)
    inert = ca.vertcat(mass.M11 @ Z[:3] + mass.M12 @ Z[3:], mass.M12.T @ Z[:3] + mass.M22 @ Z[3:])
    own = inert - velocity_force(mass, m.omega) - force
    ins = {"numbers": sym.p, "motion": motion, "force": force, "Z": Z}
    return one(f"i_weigh_{'more' if sign > 0 else 'less'}", ins, {"N": sign * own}, ["N"])
