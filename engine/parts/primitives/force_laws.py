"""Primitives of nonlinear springs and dampers."""

from __future__ import annotations

from functools import cache

import casadi as ca

from trunnion.kernel.interface.runtime_tables import MOTION
from trunnion.kernel.units.motion_and_inertia_packing import unpack_motion
from trunnion.parts.primitives.primitive_from_expressions import expression_primitive
from trunnion.parts.primitives.primitive_keys import ParameterCounter, Primitive
from trunnion.parts.primitives.primitive_symbols import PrimitiveSymbols
from trunnion.recursion.masses_and_forces import (
    line_of,
    nonlinear_energy,
    nonlinear_force,
    nonlinear_position,
    nonlinear_power,
    wrenches,
)
from trunnion.recursion.vector_algebra import SX
from trunnion.scene.force_laws.registry import REGISTRY
from trunnion.system.structure.bodies_and_joints import LawForce, Load


@cache
def along_freedom(law: str, what: str) -> Primitive:
    """Primitive of a law along a freedom. Inputs: numbers, coordinate, rate. The primitive adds one quantity (``what``) to the
    output: the ``force``, the ``power`` of a damper, or the ``potential`` energy. With ``position``, the output is the position in
    the law's curve."""
    count = ParameterCounter()
    laws = (LawForce(law, count.take(REGISTRY[law].count)),)
    sym, q, rate = PrimitiveSymbols(count.count), SX.sym("q"), SX.sym("rate")
    ins, name = {"numbers": sym.p, "q": q, "rate": rate}, f"n_along_{law}_{what}"
    if what == "position":
        return expression_primitive(name, ins, {"out": nonlinear_position(sym, laws[0], q, rate)})
    if what == "force":
        out = -nonlinear_force(sym, laws, q, rate)
    else:
        out = nonlinear_power(sym, laws, q, rate) if what == "power" else nonlinear_energy(sym, laws, q)
    return expression_primitive(name, ins, {"out": out}, ["out"])


@cache
def between_points(law: str, what: str) -> Primitive:
    """Primitive of a law between two points. Inputs: numbers (those of the law, points 3 + 3), motions of two bodies. The primitive
    adds one quantity (``what``) to the output. The quantities are the ``wrench`` on both bodies (6 each), the ``force`` that pulls
    the points together, the ``power`` of a damper, and the ``potential`` energy. With ``position``, the output is the position in
    the law's curve."""
    count = ParameterCounter()
    laws, points = (LawForce(law, count.take(REGISTRY[law].count)),), (count.take(3), count.take(3))
    sym, a, b = PrimitiveSymbols(count.count), SX.sym("a", MOTION), SX.sym("b", MOTION)
    given = Load("", "spring_damper", (0, 1), points, numbers=(0.0, 0.0, 0.0), nonlinear=laws)
    motions = [unpack_motion(ca.vertsplit(m)) for m in (a, b)]
    ins, name = {"numbers": sym.p, "a": a, "b": b}, f"n_between_{law}_{what}"
    if what == "wrench":
        (_, on_a), (_, on_b) = wrenches(sym, motions, given)
        return expression_primitive(name, ins, {"on_a": on_a, "on_b": on_b}, ["on_a", "on_b"])
    line = line_of(sym, motions, given)
    if what == "position":
        return expression_primitive(name, ins, {"out": nonlinear_position(sym, laws[0], line.length, line.rate)})
    if what == "force":
        out = nonlinear_force(sym, laws, line.length, line.rate)
    elif what == "power":
        out = nonlinear_power(sym, laws, line.length, line.rate)
    else:
        out = nonlinear_energy(sym, laws, line.length)
    return expression_primitive(name, ins, {"out": out}, ["out"])
