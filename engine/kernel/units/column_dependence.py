"""Direct dependence of columns on inputs and multipliers, from the structure of their expressions."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from trunnion.kernel.interface.output_columns import Column
from trunnion.kernel.units.column_expressions import ColumnExpressions
from trunnion.recursion.casadi_operators import direct_operators
from trunnion.recursion.inward_reduction import build_model
from trunnion.recursion.symbolic_inputs import Symbols
from trunnion.recursion.vector_algebra import SX
from trunnion.system.structure.bodies_and_joints import System


@dataclass(frozen=True)
class Dependence:
    """Dependence of a column. constant: whether the column is constant. solved: whether it contains multipliers or accelerations,
    which every force changes. values, seconds: indices of those inputs whose value or second derivative it contains."""

    constant: bool
    solved: bool
    values: tuple[int, ...]
    seconds: tuple[int, ...]


def dependence(system: System, parameters: int, chosen: list[Column], quadratures: bool) -> list[Dependence]:
    """The dependence of each column, from the sparsity of its derivatives."""
    if not chosen:
        return []
    with direct_operators():
        o = ColumnExpressions(build_model(Symbols(system, parameters)), quadratures)
        sym, values = o.sym, ca.vertcat(*(SX(o.value(c)) for c in chosen))
        solved, places = ca.vertcat(sym.lam, sym.eta, o.a), [sym.at.table(i) for i in range(len(system.inputs))]
        state = ca.vertcat(sym.x, sym.q, sym.v, sym.b, o.integrals, o.runtime)
        pattern = ca.Function("columns", [state, solved, sym.p], [values])
    by_state, by_solution = (pattern.jac_sparsity(0, i) for i in (0, 1))
    rows: list[set[int]] = [set() for _ in chosen]
    for row, column in zip(*by_state.get_triplet(), strict=True):
        rows[row].add(column)
    moved = set(by_solution.get_triplet()[0])
    standing = [[tuple(i for i, at in enumerate(places) if at + n in found) for n in (0, 2)] for found in rows]
    return [Dependence(not found and k not in moved, k in moved, *standing[k]) for k, found in enumerate(rows)]
