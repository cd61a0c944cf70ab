"""Classes of bodies. In systems too large to unroll, the step of the recursion over a body is written once per class.

Bodies of one class have joints and loads of the same structure. The inputs from their neighbours have the same patterns of constant
entries. Such bodies use the same C functions and differ only in numbers. Patterns are passed outward with the motion, and inward
with the articulated inertia. A planar branch therefore keeps its planar code.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import casadi as ca

from trunnion.kernel.interface.runtime_tables import HANDED
from trunnion.kernel.units.body_scalars import pack_handed, pack_motion, unpack_handed, unpack_motion
from trunnion.recursion.body_kinematics import GROUND_MOTION, Step, walk
from trunnion.recursion.inward_reduction import Articulated, project, transferred_inertia
from trunnion.recursion.masses_and_forces import joint_forces, mass_matrix, rotors, velocity_force, wrenches
from trunnion.recursion.symbolic_inputs import Symbols
from trunnion.recursion.vector_algebra import SX, Gamma, GammaT, symmetric, zeros
from trunnion.system.structure.bodies_and_joints import GROUND, Body, Joint, Load, System, state_coordinates
from trunnion.system.structure.friction_joint_indices import elements
from trunnion.system.structure.parameter_table import Param

Pattern = tuple[float | None, ...]
"""For each entry, its constant value, or None if it varies."""


def localise(value: Any, order: dict[int, int]) -> Any:
    """The same data, without names and with parameters renumbered in the order of their appearance."""
    if isinstance(value, Param):
        return Param(order.setdefault(value.index, len(order)))
    if isinstance(value, tuple):
        return tuple(localise(v, order) for v in value)
    if is_dataclass(value) and not isinstance(value, type):
        same = {f.name: localise(getattr(value, f.name), order) for f in fields(value) if f.name != "name"}
        return replace(value, **same, **({"name": ""} if hasattr(value, "name") else {}))
    return value


@dataclass(frozen=True)
class Shape:
    """The data that determine the code of a body's step. body, joint, loads: without names and indices. needs: the reaction
    components that the friction of the joint needs. ground: whether the ground carries the body. motion, handed: patterns of the
    inputs."""

    body: Body
    joint: Joint
    loads: tuple[Load, ...]
    needs: tuple[str, ...]
    ground: bool
    motion: Pattern
    handed: Pattern


class LocalSymbols(Symbols):
    """Symbols of one body: its parameters, coordinates and rates. Also the external values of the system."""

    def __init__(self, whole: Symbols, shape: Shape, parameters: int):
        self.system = whole.system
        self.x, self.t, self.ts = whole.x, whole.t, whole.ts
        self.at = whole.at
        self.q = SX.sym("q", len(state_coordinates(shape.joint)))
        self.v = SX.sym("v", len(shape.joint.free))
        self.p = SX.sym("p", parameters)


def symbolic(name: str, pattern: Pattern) -> tuple[SX, list[SX]]:
    """A vector symbol for a pattern, and its entries. An entry is an element of the symbol if it varies, otherwise its constant."""
    sym = SX.sym(name, len(pattern))
    return sym, [sym[i] if c is None else SX(1, 1) if c == 0.0 else SX(c) for i, c in enumerate(pattern)]


def pattern_of(values: list[SX]) -> Pattern:
    """The pattern of expressions."""
    return tuple(float(v) if v.nnz() == 0 or v.is_constant() else None for v in values)


@dataclass
class BodyCode:
    """The step of a body of one class as expressions, in stages.

    Stage 0: parameters. Stage 1, outward: x, q, v and the motion of the inboard body (``parent``) give ``motion`` and ``step``.
    Stage 2, inward: the sum of what the outboard bodies pass (``children``) gives ``art``, ``y`` and ``handed``. Stage 3, once for
    each force column of the affine maps: a column f (6) and its force g along the joint's freedoms give ``column_y``, and
    ``column_handed`` for the inboard body.
    """

    sym: LocalSymbols
    parent: SX
    children: SX
    step: Step
    motion: list[SX]
    handed: list[SX]
    y: SX
    column_f: SX
    column_g: SX
    column_y: SX
    column_handed: SX
    art: Articulated


def body_code(whole: Symbols, shape: Shape, parameters: int) -> BodyCode:
    """The step over a body of a class, built from the same functions as the unrolled recursion."""
    sym = LocalSymbols(whole, shape, parameters)
    parent, entries = symbolic("P", shape.motion)
    motion, step = walk(sym, shape.joint, GROUND_MOTION if shape.ground else unpack_motion(entries))
    children, handed_in = symbolic("H", shape.handed)
    d11, d12, d22, dF = unpack_handed(handed_in)
    mass = mass_matrix(sym, shape.body, motion.R)
    own = velocity_force(mass, motion.omega)
    for load in shape.loads:
        own = own + sum((w for _, w in wrenches(sym, {load.bodies[0]: motion}, load)), zeros(6))
    art = Articulated(symmetric(mass.M11 + d11), ca.sparsify(mass.M12 + d12), symmetric(mass.M22 + d22), ca.sparsify(own + dF))
    forces = joint_forces(sym, step)
    Q = ca.sparsify(ca.vertcat(SX(0, 1), *[forces[k] for k in shape.joint.free]))
    project(art, step, Q, rotors(sym, shape.joint))
    M11, M12, M22 = transferred_inertia(art, step.lever)
    moved = art.F - art.MPi @ art.y - art.times(step.w[:3], step.w[3:])
    handed = pack_handed(M11, M12, M22, GammaT(step.lever, ca.sparsify(moved)))
    f, g = SX.sym("f", 6), SX.sym("g", step.Pi.size2())
    column_y = art.solve(step.Pi.T @ f + g)
    column_handed = GammaT(step.lever, f - art.MPi @ column_y)
    return BodyCode(sym, parent, children, step, pack_motion(motion), handed, art.y, f, g, column_y, column_handed, art)


@dataclass
class Outward:
    """The outward step of a body. Inputs: Ż of the inboard body (Z); y and F̄ for the present multipliers (y, f). Results: q̈
    (qdd), Ż of the body (Zo), and the reaction N."""

    Z: SX
    y: SX
    f: SX
    qdd: SX
    Zo: SX
    N: SX


def outward_step(code: BodyCode, biased: bool) -> Outward:
    """The outward step of a class. biased: whether to add w; a column of the affine maps has no w."""
    step, Z, y, f = code.step, SX.sym("Z", 6), SX.sym("yc", code.step.Pi.size2()), SX.sym("fc", 6)
    carried = Gamma(step.lever, Z)
    qdd = y - code.art.solve(code.art.MPi.T @ carried)
    out = carried + step.Pi @ qdd + (step.w if biased else zeros(6))
    return Outward(Z, y, f, qdd, out, code.art.times(out[:3], out[3:]) - f)


@dataclass
class Classes:
    """The bodies of a system by class. shapes: the shape of each body. parameters: for each body, the indices in the system of its
    local parameters. codes: the expressions of each distinct shape."""

    shapes: list[Shape]
    parameters: list[list[int]]
    codes: dict[Shape, BodyCode]

    @property
    def index(self) -> dict[Shape, int]:
        """Number of each distinct shape."""
        return {s: i for i, s in enumerate(self.codes)}


def classify(whole: Symbols) -> Classes:
    """Sort the bodies into classes. An outward pass finds the patterns of motions, an inward pass the patterns of articulated
    inertias."""
    system = whole.system
    none, full = (0.0,) * HANDED, tuple
    raw: list[Shape] = []
    orders: list[list[int]] = []
    motions: list[Pattern] = []
    codes: dict[Shape, BodyCode] = {}

    def code(shape: Shape, count: int) -> BodyCode:
        if shape not in codes:
            codes[shape] = body_code(whole, shape, count)
        return codes[shape]

    for i, body in enumerate(system.bodies):
        shape, order = _shape(system, i, motions[body.parent] if body.parent != GROUND else full(()), none)
        raw.append(shape)
        orders.append(order)
        motions.append(pattern_of(code(shape, len(order)).motion))
    handed: list[list[float | None]] = [list(none) for _ in system.bodies]
    shapes = list(raw)
    for i in reversed(range(len(system.bodies))):
        shapes[i] = replace(raw[i], handed=tuple(handed[i]))
        parent = system.bodies[i].parent
        own = pattern_of(code(shapes[i], len(orders[i])).handed)
        if parent != GROUND:
            both = zip(handed[parent], own, strict=True)
            handed[parent] = [0.0 if a == 0.0 and b == 0.0 else None for a, b in both]
    used = {s: codes[s] for s in dict.fromkeys(shapes)}
    return Classes(shapes, orders, used)


def _shape(system: System, i: int, motion: Pattern, handed: Pattern) -> tuple[Shape, list[int]]:
    """Shape of body i, and the indices of its local parameters in the system."""
    order: dict[int, int] = {}
    needs = next((e.needs for e in elements(system) if e.joint.child == i), ())
    body, joint = system.bodies[i], system.tree[i]
    loads = tuple(load for load in system.loads if i in load.bodies)
    joint = replace(joint, inb=0, out=0, child=0, q0=0, v0=0, friction=None)
    shape = Shape(
        localise(replace(body, joint=0, parent=0, points=()), order), localise(joint, order),
        localise(tuple(replace(load, bodies=(0,)) for load in loads), order), needs, body.parent == GROUND, motion, handed,
    )
    return shape, list(order)
