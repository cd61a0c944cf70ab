"""Sums and products of scene values: two plain numbers give a number; any other operands give an expression in braces."""

from __future__ import annotations

from typing import Any

from trunnion.scene.expressions.parameter_evaluation import Parameters, expression_text, is_expression
from trunnion.scene.units.numbers_with_units import NoValue, number
from trunnion.scene.units.unit_parser import UnitError

Term = Any
"""A number, a text with a number and a unit, or an expression in braces."""
LARGEST = 1e300


def is_number(value: Any) -> bool:
    """Whether a value is a plain number of magnitude below ``LARGEST``. The limit keeps products from overflowing."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < LARGEST


def source(value: Term) -> str:
    """The value as text for use in an expression. A plain number is marked as SI, in the unit that its place requires."""
    if is_expression(value):
        return f"({expression_text(value)})"
    if is_number(value):
        return f"({float(value)!r} SI)"
    if isinstance(value, str):
        return f"({value})"
    raise UnitError("a place or direction has three numbers", "write [x, y, z]")


def known(value: Term) -> float:
    """The SI value of a term. Raises UnitError when the term depends on a parameter or is not a number."""
    found = Parameters().computed(value) if is_expression(value) else number(value)
    if isinstance(found, NoValue):
        raise UnitError(found.what, found.hint)
    return float(found)


def plus(a: Term, b: Term) -> Term:
    """The sum of two values."""
    if is_number(a) and is_number(b):
        return a + b
    if is_number(a) and not a:
        return b
    if is_number(b) and not b:
        return a
    return f"{{{source(a)} + {source(b)}}}"


def times(factor: Term, a: Term) -> Term:
    """The product of a value and a dimensionless factor (a plain number or an expression)."""
    if is_number(factor) and is_number(a):
        return factor * a + 0.0  # + 0.0 turns −0 into 0
    if is_number(factor) and factor in (0.0, 1.0):
        return a if factor else 0.0
    if is_number(a) and not a:
        return 0.0
    if is_number(factor) and factor == -1.0:
        return f"{{-{source(a)}}}"
    return f"{{{float(factor)!r}*{source(a)}}}" if is_number(factor) else f"{{{source(factor)}*{source(a)}}}"


def three(value: Any) -> list[Term]:
    """The three entries of a list. Raises UnitError when the value is not a list of three."""
    if not isinstance(value, list) or len(value) != 3:
        raise UnitError("a place or direction has three numbers", "write [x, y, z]")
    return list(value)
