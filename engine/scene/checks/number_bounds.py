"""Checks of every number: its bounds, its order relative to other numbers, and its dimension if the joint type determines the unit.
For example, a hinge angle in millimetres is a mistake."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.findings.findings_and_paths import Finding, Path, last_key
from trunnion.scene.queries.numbers_by_path import PLAIN, bound_of, numbers, order_of
from trunnion.scene.units.dimension_names import unit_of
from trunnion.scene.units.numbers_with_units import Quantity, agree
from trunnion.scene.units.unit_parser import UnitError, parse_unit


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about values, their order and dimensions."""
    values: dict[Path, float] = {}
    for path, value, unit in numbers(scene):
        values[path] = value
        bound = bound_of(path)
        if not bound.holds(value):
            yield Finding(path, bound.refusal(last_key(path), value), bound.advice)
        if not isinstance(value, Quantity) or path[0] == "parameters":
            continue  # a parameter may have any dimension
        if path[0] == "inputs" and not _is_unit(unit):
            continue  # checks.names reports the invalid unit of the input
        if unit == PLAIN and path[-2] in ("axis", "reference", "towards") and value.dimension == parse_unit("m").dimension:
            continue  # the components of a direction may be lengths
        try:
            agree(value, unit)
        except UnitError as e:
            is_start = path[0] == "inputs" and unit == PLAIN
            yield Finding(path, e.what, f"give the input its unit: unit: {unit_of(value.dimension)}" if is_start else e.hint)
    for path, value in values.items():
        yield from _order(path, value, values)


def _order(path: Path, high: float, values: Mapping[Path, float]) -> Iterator[Finding]:
    """A finding if two numbers of one group are in the wrong order. If one of the numbers violates its own bound, there is no such
    finding."""
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
