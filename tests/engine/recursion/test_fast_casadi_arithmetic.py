"""Direct arithmetic on CasADi matrices equals the library's arithmetic. Other users of the library are not affected."""

from __future__ import annotations

import operator
from collections.abc import Callable

import casadi as ca
import pytest

from trunnion.recursion.fast_casadi_arithmetic import direct_operators

OPERATIONS = (operator.add, operator.sub, operator.mul, operator.truediv)


def operands() -> list[tuple]:
    """Operands: scalars, columns and matrices, full and with structural zeros, numbers on either side, and another type of
    matrix."""
    a, v, m = ca.SX.sym("a"), ca.SX.sym("v", 3), ca.SX.sym("m", 3, 2)
    sparse = ca.sparsify(ca.vertcat(a, 0, v[1]))
    return [
        (a, a),
        (a, v),
        (v, a),
        (v, v),
        (m, a),
        (m, m),
        (sparse, v),
        (v, sparse),
        (sparse, 2.0),
        (2, m),
        (0.0, sparse),
        (v, ca.DM([1, 2, 3])),
    ]


@pytest.mark.parametrize("operation", OPERATIONS)
def test_direct_operators_build_the_same_expressions_as_the_library(operation: Callable) -> None:
    pairs = operands()
    usual = [str(operation(x, y)) for x, y in pairs]
    with direct_operators():
        assert [str(operation(x, y)) for x, y in pairs] == usual


def test_shapes_that_do_not_fit_are_still_refused() -> None:
    with direct_operators(), pytest.raises(RuntimeError):
        ca.SX.sym("v", 3) + ca.SX.sym("w", 2)


def test_the_librarys_operators_are_back_afterwards_whatever_happened() -> None:
    before = {n: getattr(ca.SX, n) for n in ("__add__", "__rmul__", "__truediv__")}
    with pytest.raises(ZeroDivisionError), direct_operators(), direct_operators():
        1 / 0  # noqa: B018
    assert {n: getattr(ca.SX, n) for n in before} == before
