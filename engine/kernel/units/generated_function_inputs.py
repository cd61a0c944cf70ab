"""Arguments of generated functions, in C and as symbols."""

from __future__ import annotations

import casadi as ca

from trunnion.elements.joints.joint_kind import quaternion_rate
from trunnion.kernel.c_code.code_generator import Input, Stage
from trunnion.recursion.complement_equation_terms import bristle_rates
from trunnion.recursion.inward_reduction import Model
from trunnion.recursion.outward_accelerations import Accelerations
from trunnion.recursion.symbolic_inputs import Symbols
from trunnion.recursion.vector_algebra import SX
from trunnion.system.structure.bodies_and_joints import state_coordinates

CONST = "const double*restrict "
STATE = f"{CONST}x,{CONST}y,{CONST}c"
PARAMETERS = f"{CONST}p,double*restrict c"
PREPARE = f"const void*scene,{PARAMETERS}"


def inputs(sym: Symbols) -> list[Input]:
    """Stage inputs with their C names: parameters, external values, state."""
    nq, nv = sym.system.nq, sym.system.nv
    state = [Input("y", sym.q, 1), Input(f"y+{nq}", sym.v, 1), Input(f"y+{nq + nv}", sym.b, 1)]
    return [Input("p", sym.p, 0), Input("x", sym.x, 1), *state]


def row_inputs(sym: Symbols, a: SX) -> list[Input]:
    """Stage inputs of functions that compute columns: multipliers [λ of all rows | η], and accelerations a of the free rates."""
    return [Input("z", sym.lam, 1), Input(f"z+{sym.system.rows}", sym.eta, 1), Input("a", a, 1)]


def with_constants(prepare: str, function: str, arguments: str) -> list[Stage]:
    """Two stages: the computation of constants from parameters, and the computation of the function."""
    return [Stage(prepare, PARAMETERS, "c"), Stage(function, arguments, "")]


def active_rows(m: Model) -> tuple[int, ...]:
    """Constraint rows that are not structurally zero. In a planar loop of spatial joints, most rows are structurally zero."""
    return tuple(k for k in range(m.sym.system.rows) if m.S[k, :].nnz() or m.Se[k, :].nnz() or m.g0[k].nnz())


class Multipliers:
    """Multipliers that act on the motion: η, and λ of the active rows (in the redundant variant: of all rows)."""

    def __init__(self, m: Model, redundant: bool):
        self.sym, rows = m.sym, range(m.sym.system.rows)
        self.active = list(rows) if redundant else list(active_rows(m))
        self.inactive = [k for k in rows if k not in self.active]
        self.lam = ca.vertcat(SX(0, 1), *[self.sym.lam[k] for k in self.active])

    def inputs(self, stage: int) -> list[Input]:
        """Stage inputs [λ active | η]."""
        return [Input("z", self.lam, stage), Input(f"z+{len(self.active)}", self.sym.eta, stage)]

    def without_inactive(self, values: list[SX]) -> list[SX]:
        """The expressions with zero for the multipliers of inactive rows. The coefficients of these multipliers are structural
        zeros."""
        if not self.inactive:
            return values
        old = ca.vertcat(*[self.sym.lam[k] for k in self.inactive])
        return ca.substitute(values, [old], [SX.zeros(len(self.inactive))])


def combination(sym: Symbols) -> SX:
    """The column [1; λ; η], by which affine maps are multiplied."""
    return ca.vertcat(SX(1), sym.lam, sym.eta)


def state_rates(m: Model, acc: Accelerations, pick: SX) -> list[SX]:
    """F = [q̇; v̇; rates of friction states]."""
    accelerations = [a[i] for a in acc.qdd for i in range(a.numel())]
    return [*qdot(m.sym, m.sym.v), *accelerations, *bristle_rates(m, acc, pick)]


def qdot(sym: Symbols, v: SX) -> list[SX]:
    """q̇ of the coordinates in the state, for rates v (nv)."""
    out: list[SX] = []
    for j in sym.system.tree:
        quaternion = j.kind.quaternion
        for i in state_coordinates(j):
            if quaternion < 0 or i < quaternion:
                rate = next(k for k in range(j.kind.nv) if j.kind.coordinate_of(k) == i)
                out.append(v[j.v0 + j.free.index(rate)])
        if quaternion >= 0:
            first = j.q0 + state_coordinates(j).index(quaternion)
            spin = [v[j.v0 + j.free.index(j.kind.nv - 3 + k)] for k in range(3)]
            out += quaternion_rate([sym.q[first + i] for i in range(4)], spin)
    return out
