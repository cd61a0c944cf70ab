"""Constant rate of a drive."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from trunnion.basics.lazy_casadi import ca
from trunnion.basics.lazy_data_classes import validated
from trunnion.scene.data_classes.field_types import STRICT
from trunnion.scene.signals.declaration import SignalKind, Triple
from trunnion.scene.units.numbers_with_units import Number


@validated(frozen=True, config=STRICT)
class Constant:
    """Constant rate of a drive: q = start + rate t."""

    rate: Number
    """Rate of the coordinate."""
    start: Number = 0.0
    """Coordinate at t = 0."""


class ConstantKind(SignalKind):
    """q = start + rate t."""

    key, data, text = "constant", Constant, "Constant rate."
    labels = {"rate": 2}  # noqa: RUF012
    loads = "a constant load is written as a plain number"
    rates = ("rate",)

    def signal(self, data: Constant, put: Any) -> Any:
        return put.signal("rate", put.own("start", data.start), put.own("rate", data.rate, put.rate))

    def motion(self, sym: Any, s: Any) -> Triple:
        start, rate = (sym.leaf(x) for x in s.leaves)
        return start + rate * sym.t, rate, ca.SX(0)

    def paces(self, s: Any, turns: bool) -> Iterator[tuple[Any, float]]:
        if turns:
            yield s.leaves[1], 0.5 / math.pi

    def coordinate(self, data: Constant, t: float) -> float:
        return data.start + data.rate * t

