"""Linear programs compared with their duals: the two optimal values bound each other from both sides."""

from __future__ import annotations

import numpy as np
import pytest

from trunnion.analysis.static_bounds.linear_program_solver import LinearProgram

CLOSE = 1e-9
"""Allowed difference: ten times the tolerances of the solver; all numbers are of size 1."""


def least(cost: np.ndarray, rows: np.ndarray, right: np.ndarray, equal: int) -> float:
    """The least value of the objective within a box about the origin with sides of length 2."""
    program, side = LinearProgram(), np.ones(len(cost))
    program.load(cost, rows, right, equal, -side, side)
    found = program.solve()
    assert found is not None
    value, x = found
    assert (rows @ x <= right + CLOSE).all()
    assert rows[:equal] @ x == pytest.approx(right[:equal], abs=CLOSE)
    assert value == pytest.approx(float(cost @ x), abs=CLOSE)
    return value


def largest_of_dual(cost: np.ndarray, rows: np.ndarray, right: np.ndarray, equal: int) -> float:
    """max −right·u − Σ (v + w) with cost + rowsᵀ u + v − w = 0, v, w ≥ 0 and u ≥ 0 for inequalities."""
    m, n = rows.shape
    program = LinearProgram()
    low = np.concatenate([np.full(equal, -100.0), np.zeros(m - equal + 2 * n)])
    rows_of_dual = np.hstack([rows.T, np.eye(n), -np.eye(n)])
    program.load(
        np.concatenate([right, np.ones(2 * n)]), rows_of_dual, -cost, n, low, np.full(m + 2 * n, 100.0)
    )
    found = program.solve()
    assert found is not None
    return -found[0]


@pytest.mark.parametrize("equal", [0, 2])
def test_the_least_value_is_the_largest_of_the_dual(equal: int) -> None:
    rng = np.random.default_rng(equal)
    for _ in range(10):
        cost, rows = rng.normal(size=6), rng.normal(size=(9, 6))
        right = rows @ rng.uniform(-0.5, 0.5, 6) + np.where(np.arange(9) < equal, 0.0, rng.uniform(0.0, 0.1, 9))
        assert least(cost, rows, right, equal) == pytest.approx(largest_of_dual(cost, rows, right, equal), abs=CLOSE)


def test_a_changed_program_has_the_solution_of_a_new_one() -> None:
    rng = np.random.default_rng(1)
    cost, other, rows, more = rng.normal(size=6), rng.normal(size=6), rng.normal(size=(9, 6)), rng.normal(size=(3, 6))
    kept, side = LinearProgram(), np.ones(6)
    kept.load(cost, rows, np.zeros(9), 0, -side, side)
    kept.solve()
    kept.set_cost(other)
    kept.add(more)
    found = kept.solve()
    assert found is not None
    assert found[0] == pytest.approx(least(other, np.vstack([rows, more]), np.zeros(12), 0), abs=CLOSE)


def test_rows_that_exclude_each_other_have_no_solution() -> None:
    program, side = LinearProgram(), np.ones(2)
    program.load(side, np.array([[1.0, 0.0], [-1.0, 0.0]]), np.array([-0.5, 0.4]), 0, -side, side)
    assert program.solve() is None
