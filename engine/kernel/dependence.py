"""What columns depend on at once: found from the structure of their expressions, not from values."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from engine.kernel.columns import Column
from engine.kernel.output_unit import Outputs
from engine.recursion.direct import direct_operators
from engine.recursion.reduction import unreduced
from engine.recursion.symbols import Symbols
from engine.recursion.vectors import SX
from engine.system.structure import System


@dataclass(frozen=True)
class Dependence:
    """Of a column: whether it is a constant; whether it is made of multipliers or accelerations, which every force changes; the
    inputs (numbers) whose value or second derivative stands in it."""

    constant: bool
    solved: bool
    values: tuple[int, ...]
    seconds: tuple[int, ...]


def dependence(system: System, parameters: int, chosen: list[Column], quadratures: bool) -> list[Dependence]:
    """The dependence of each column, from the sparsity of its derivatives."""
    if not chosen:
        return []
    with direct_operators():
        o = Outputs(unreduced(Symbols(system, parameters)), quadratures)
        sym, values = o.sym, ca.vertcat(*(SX(o.value(c.key)) for c in chosen))
        solved, places = ca.vertcat(sym.lam, sym.eta, o.a), [sym.at.table(i) for i in range(len(system.inputs))]
        state = ca.vertcat(sym.x, sym.q, sym.v, sym.b, o.quad, o.extra)
        pattern = ca.Function("columns", [state, solved, sym.p], [values])
    by_state, by_solution = (pattern.jac_sparsity(0, i) for i in (0, 1))
    rows: list[set[int]] = [set() for _ in chosen]
    for row, column in zip(*by_state.get_triplet(), strict=True):
        rows[row].add(column)
    moved = set(by_solution.get_triplet()[0])
    standing = [[tuple(i for i, at in enumerate(places) if at + n in found) for n in (0, 2)] for found in rows]
    return [Dependence(not found and k not in moved, k in moved, *standing[k]) for k, found in enumerate(rows)]
