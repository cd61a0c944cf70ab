"""Linear programs, solved by the dual simplex method of HiGHS through its Python package highspy. For the small programs of static
bounds, this takes a tenth of the time of ``scipy.optimize.linprog``. A changed program is solved from the last basis."""

from __future__ import annotations

from typing import Any

import numpy as np

from trunnion.basics.optional_packages import brought

highs: Any = brought("highspy", "analysis", "the analysis of friction bounds")
OPTIONS = {
    "output_flag": False, "solver": "simplex", "simplex_strategy": 1, "threads": 1,
    "primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10,
}  # fmt: skip
"""The smallest tolerances of the solver, relative to the loads. These tolerances limit the accuracy of certified values. Strategy 1
is the serial dual method. Presolving is off, because for small programs it costs more time than it saves."""
ROWWISE, MINIMISE = 2, 1


class Failed(ArithmeticError):
    """The solver neither found a solution nor proved that there is none."""


class LinearProgram:
    """Minimise cost·x subject to rows · x = right (the first rows) or ≤ right, and low ≤ x ≤ high."""

    def __init__(self) -> None:
        self.highs = highs._Highs()  # the constructor of the class Highs prints a banner
        for name, value in OPTIONS.items():
            self.highs.setOptionValue(name, value)

    def load(
        self, cost: np.ndarray, rows: np.ndarray, right: np.ndarray, equal: int, low: np.ndarray, high: np.ndarray
    ) -> None:  # fmt: skip
        """Replace the program. equal: number of the first rows that are equations."""
        least = np.where(np.arange(len(rows)) < equal, right, -np.inf)
        start, index, value = _sparse(rows)
        self.highs.passModel(
            len(cost), len(rows), len(value), ROWWISE, MINIMISE, 0.0, cost, low, high, least, right, start, index, value,
            np.zeros(len(cost), np.int32),
        )  # fmt: skip

    def add(self, rows: np.ndarray) -> None:
        """Add rows · x ≤ 0."""
        start, index, value = _sparse(rows)
        self.highs.addRows(len(rows), np.full(len(rows), -np.inf), np.zeros(len(rows)), len(value), start, index, value)

    def set_cost(self, cost: np.ndarray) -> None:
        """Replace the cost."""
        self.highs.changeColsCost(len(cost), np.arange(len(cost), dtype=np.int32), cost)

    def solve(self) -> tuple[float, np.ndarray] | None:
        """(least value, x); None if no x satisfies the rows."""
        status = highs.HighsModelStatus
        for presolve in ("off", "on"):
            if presolve == "on":
                self.highs.clearSolver()
            self.highs.setOptionValue("presolve", presolve)
            self.highs.run()
            found = self.highs.getModelStatus()
            if found == status.kInfeasible:
                return None
            if found == status.kOptimal:
                return self.highs.getInfo().objective_function_value, np.array(self.highs.getSolution().col_value)
        raise Failed


def _sparse(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(start of each row, columns, values) of the entries that are not 0."""
    at, index = np.nonzero(rows)
    start = np.searchsorted(at, np.arange(len(rows)))
    return start.astype(np.int32), index.astype(np.int32), rows[at, index]
