"""What all generated units have in common: how their functions are called, and the state they are functions of."""

from __future__ import annotations

import casadi as ca

from engine.joints.base import quaternion_rate
from engine.kernel.emit import Input
from engine.recursion.reduction import Model
from engine.recursion.symbols import Symbols
from engine.recursion.vectors import SX
from engine.system.structure import state_coordinates

CONST = "const double*restrict "
STATE = f"{CONST}x,{CONST}y,{CONST}c"
PREPARE = f"const void*scene,{CONST}p,double*restrict c"


def inputs(sym: Symbols) -> list[Input]:
    """Stage inputs with their C names: parameters, external values, state, multipliers [λ active | η]."""
    nq, nv = sym.system.nq, sym.system.nv
    state = [Input("y", sym.q, 1), Input(f"y+{nq}", sym.v, 1), Input(f"y+{nq + nv}", sym.b, 1)]
    return [Input("p", sym.p, 0), Input("x", sym.x, 1), *state]


def active_rows(m: Model) -> tuple[int, ...]:
    """Constraint rows that are not structurally empty (in a planar loop of spatial joints most of them are)."""
    rows = []
    for k in range(m.sym.system.rows):
        if m.S[k, :].nnz() or m.Se[k, :].nnz() or m.g0[k].nnz():
            rows.append(k)
    return tuple(rows)


def combination(sym: Symbols) -> SX:
    """The column [1; λ; η] that puts multipliers into affine maps."""
    return ca.vertcat(SX(1), sym.lam, sym.eta)


def qdot(sym: Symbols, v: SX) -> list[SX]:
    """q̇ of the state's coordinates for rates v (nv)."""
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
