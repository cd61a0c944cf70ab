"""Balance of a body with known accelerations. Each term is a separate primitive with its own tangents (``primitive_derivatives``).

In this module, ``work`` contains a body's lever (3), the nonzeros of Π for its free freedoms, and w (6)."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import casadi as ca

from trunnion.elements.joints import REGISTRY
from trunnion.kernel.interface.runtime_tables import MOTION
from trunnion.kernel.units.motion_and_inertia_packing import pack_motion, unpack_motion
from trunnion.parts.primitives.primitive_from_expressions import expression_primitive
from trunnion.parts.primitives.primitive_keys import BodyKey, ParameterCounter, Primitive
from trunnion.parts.primitives.primitive_symbols import PrimitiveSymbols, a_body, a_joint
from trunnion.recursion.body_kinematics import Motion, Step, walk
from trunnion.recursion.masses_and_forces import mass_matrix, velocity_force
from trunnion.recursion.vector_algebra import SX, Gamma, GammaT


def _walked(which: BodyKey) -> tuple[PrimitiveSymbols, SX, Motion, Step]:
    """For a body: symbols of the body's joint and of the inboard body's motion, the motion of the body, and the step over the
    joint."""
    kind, count = REGISTRY[which.kind], ParameterCounter()
    joint = a_joint(count, which.kind, which.forward, which.driven, kind.pitched, kind.nv)
    a_body(count)
    sym, carrier = PrimitiveSymbols(count.count, kind), SX.sym("carrier", MOTION)
    motion, step = walk(sym, joint, unpack_motion(ca.vertsplit(carrier)))
    return sym, carrier, motion, step


def _named(which: BodyKey, what: str) -> str:
    return f"i{which.name}_{what}"


@cache
def outward(which: BodyKey) -> Primitive:
    """Primitive of a body's motion. Inputs: numbers, coordinates, rates and prescribed accelerations of the joint; motion of the
    inboard body. Outputs: motion, pose, work."""
    sym, carrier, motion, step = _walked(which)
    ins = {"numbers": sym.p, "q": sym.q, "v": sym.v, "known": sym.known, "carrier": carrier}
    pose = ca.vertcat(ca.vec(ca.densify(step.Ein)), ca.vec(ca.densify(step.Eout)), ca.densify(step.s))
    columns = ca.vec(step.Pi)
    own = ca.vertcat(ca.densify(step.lever), columns[columns.sparsity().row()], ca.densify(step.w))
    made = expression_primitive(_named(which, "outward"), ins, {"motion": pack_motion(motion), "pose": pose, "work": own})
    return replace(made, sizes={"work": int(own.numel())})


def _kept(which: BodyKey) -> tuple[SX, SX, SX, SX]:
    """The vector of all symbols of ``work``, and the lever, Π and w that this vector contains."""
    pattern = _walked(which)[3].Pi.sparsity()
    all_of = SX.sym("work", 9 + pattern.nnz())
    return all_of, all_of[:3], SX(pattern, all_of[3:-6]), all_of[-6:]


@cache
def moved(which: BodyKey) -> Primitive:
    """Primitive of a body's acceleration. Inputs: work, Ż of the inboard body, q̈ of the free freedoms. Output: Ż of the body."""
    all_of, lever, Pi, w = _kept(which)
    Z, a = SX.sym("Z", 6), SX.sym("a", Pi.size2())
    return expression_primitive(_named(which, "moved"), {"work": all_of, "Z": Z, "qdd": a}, {"Zo": Gamma(lever, Z) + Pi @ a + w})


@cache
def carry(which: BodyKey) -> Primitive:
    """Inputs: work, reaction on the body (6). The primitive adds the wrench of this reaction on the inboard body to the output."""
    all_of, lever, _, _ = _kept(which)
    N = SX.sym("N", 6)
    return expression_primitive(_named(which, "carry"), {"work": all_of, "N": N}, {"up": GammaT(lever, N)}, ["up"])


@cache
def turned(which: BodyKey) -> Primitive:
    """Inputs: work, reaction on the body (6). The primitive subtracts two results of this reaction from the outputs: the wrench on
    the inboard body, and the forces along the free freedoms."""
    all_of, lever, Pi, _ = _kept(which)
    N = SX.sym("N", 6)
    return expression_primitive(
        _named(which, "turned"), {"work": all_of, "N": N}, {"up": -GammaT(lever, N), "along": -(Pi.T @ N)}, ["up", "along"]
    )


@cache
def weigh(sign: int) -> Primitive:
    """Inputs: numbers of a body (mass, centre 3, inertia 6), motion, wrench on the body (6), Ż. The primitive adds sign · (M Ż − F)
    to the output. F includes the wrench and the velocity forces."""
    count = ParameterCounter()
    body = a_body(count)
    sym, motion = PrimitiveSymbols(count.count), SX.sym("motion", MOTION)
    force, Z = SX.sym("force", 6), SX.sym("Z", 6)
    m = unpack_motion(ca.vertsplit(motion))
    mass = mass_matrix(sym, body, m.R)
    inert = ca.vertcat(mass.M11 @ Z[:3] + mass.M12 @ Z[3:], mass.M12.T @ Z[:3] + mass.M22 @ Z[3:])
    own = inert - velocity_force(mass, m.omega) - force
    ins = {"numbers": sym.p, "motion": motion, "force": force, "Z": Z}
    return expression_primitive(f"i_weigh_{'more' if sign > 0 else 'less'}", ins, {"N": sign * own}, ["N"])
