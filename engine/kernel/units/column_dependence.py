"""Direct dependence of columns on inputs and multipliers, from the structure of their expressions."""

from __future__ import annotations

import casadi as ca

from trunnion.kernel.interface.output_columns import Column
from trunnion.kernel.units.column_expressions import ColumnExpressions
from trunnion.recursion.fast_casadi_arithmetic import direct_operators
from trunnion.recursion.inward_reduction import build_model
from trunnion.recursion.symbolic_inputs import Symbols
from trunnion.recursion.vector_algebra import SX
from trunnion.system.structure.bodies_and_joints import System


def dependence(
    system: System, parameters: int, chosen: list[Column], quadratures: bool
) -> list[tuple[bool, bool, list[int], list[int]]]:
    """(constant, solved, values, seconds) for each column, from the sparsity of its derivatives. constant: whether the column is
    constant. solved: whether it contains multipliers or accelerations, which depend on every force. values: indices of the inputs
    whose value it contains. seconds: indices of the inputs whose second derivative it contains."""
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

    def standing(found: set[int], order: int) -> list[int]:
        return [i for i, at in enumerate(places) if at + order in found]

    return [(not found and k not in moved, k in moved, standing(found, 0), standing(found, 2)) for k, found in enumerate(rows)]
