"""Every number: a value it may have, and a dimension that fits where that depends on the joint it belongs to (a hinge angle in
millimetres is a mistake)."""

from __future__ import annotations

from collections.abc import Iterator

from engine.scene.contexts import PLAIN, bound_of, numbers
from engine.scene.finding import Finding, called
from engine.scene.model import Scene
from engine.scene.quantities import Quantity, agree
from engine.scene.units import UnitError, parse_unit


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about values and dimensions."""
    for path, value, unit in numbers(scene):
        bound = bound_of(path)
        if not bound.holds(value):
            yield Finding(path, bound.refusal(called(path), value), bound.advice)
        if not isinstance(value, Quantity):
            continue
        if path[0] == "inputs" and not _is_unit(unit):
            continue  # said at the input's unit
        if unit == PLAIN and path[-2] in ("axis", "reference") and value.dimension == parse_unit("m").dimension:
            continue  # a direction may be given by lengths
        try:
            agree(value, unit)
        except UnitError as e:
            yield Finding(path, e.what, e.hint)


def _is_unit(text: str) -> bool:
    try:
        parse_unit("" if text == PLAIN else text)
    except UnitError:
        return False
    return True
