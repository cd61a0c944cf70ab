"""Checks of every number: a value it may have, the right side of another number, and, where the unit depends on the joint it
belongs to, a fitting dimension (a hinge angle in millimetres is a mistake)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from engine.scene.contexts import PLAIN, bound_of, numbers, order_of
from engine.scene.finding import Finding, Path, called
from engine.scene.model import Scene
from engine.scene.quantities import Quantity, agree
from engine.scene.units import UnitError, parse_unit


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about values, their order and dimensions."""
    values: dict[Path, float] = {}
    for path, value, unit in numbers(scene):
        values[path] = value
        bound = bound_of(path)
        if not bound.holds(value):
            yield Finding(path, bound.refusal(called(path), value), bound.advice)
        if not isinstance(value, Quantity) or path[0] == "parameters":
            continue  # the dimension of a parameter is its own
        if path[0] == "inputs" and not _is_unit(unit):
            continue  # the mistake is told at the input's unit
        if unit == PLAIN and path[-2] in ("axis", "reference", "towards") and value.dimension == parse_unit("m").dimension:
            continue  # a direction may be given by lengths
        try:
            agree(value, unit)
        except UnitError as e:
            yield Finding(path, e.what, e.hint)
    for path, value in values.items():
        yield from _order(path, value, values)


def _order(path: Path, high: float, values: Mapping[Path, float]) -> Iterator[Finding]:
    """A mistake when a number is on the wrong side of another of its owner; told only when neither value is a mistake by itself."""
    order = order_of(path)
    below = (*path[:-1], order.low) if order is not None else path
    if order is None or below not in values or order.holds(values[below], high):
        return
    if bound_of(path).holds(high) and bound_of(below).holds(values[below]):
        yield Finding(path, order.refusal(values[below], high), about=(below,))


def _is_unit(text: str) -> bool:
    try:
        parse_unit("" if text == PLAIN else text)
    except UnitError:
        return False
    return True
