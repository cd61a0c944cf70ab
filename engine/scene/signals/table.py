"""A curve through values at given times."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, Literal

from trunnion.basics.lazy_data_classes import validated
from trunnion.scene.data_classes.field_types import STRICT
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.signals.declaration import Corner, SignalKind, interpolated
from trunnion.scene.units.numbers_with_units import Number, Time

Interpolation = Literal["natural", "clamped", "monotone", "linear"]


@validated(frozen=True, config=STRICT)
class Table:
    """A curve through values at given times. Outside the table, drives continue at constant rate and loads keep their value."""

    time: tuple[Time, ...]
    """At least two increasing times."""
    value: tuple[Number, ...]
    """One value for each time."""
    interpolation: Interpolation | None = None
    """natural: cubic spline with zero second derivative at its ends. clamped: cubic spline with the rates ``end_rates`` at its
    ends. monotone: cubic pieces, monotone between any two values (the second derivative jumps at the times). linear: straight
    lines, for loads only. Default: natural for drives, linear for loads."""
    end_rates: tuple[Number, Number] | None = None
    """With interpolation clamped: rate at the first and at the last time; default: zero."""


class TableKind(SignalKind):
    """The curve is a record in the runtime's memory (``system.signals.signal_tables``)."""

    key, data, text = "table", Table, "Curve through values at times."
    rates = ("end_rates",)

    def signal(self, data: Table, put: Any) -> Any:
        return put.curve(data)

    def corners(self, data: Table) -> Iterator[Corner]:
        yield from (Corner(t) for t in data.time)

    def crossings(self, data: Table, level: float) -> Iterator[Corner]:
        for (t, v), (u, w) in pairwise(zip(data.time, data.value, strict=True)):
            if (v - level) * (w - level) < 0.0:
                yield Corner(t + (u - t) * (level - v) / (w - v))

    def unlimited(self, data: Table) -> str:
        return "" if data.interpolation in (None, "linear") else f"a table with interpolation: {data.interpolation}"

    def findings(self, path: Path, data: Table, drive: bool) -> Iterator[Finding]:
        if len(data.time) != len(data.value):
            yield Finding((*path, "value"), f"{len(data.time)} times but {len(data.value)} values", "give one value for each time")
        if len(data.time) < 2:
            yield Finding((*path, "time"), "a table needs two entries at least")
        for i in range(1, len(data.time)):
            if not data.time[i - 1] < data.time[i]:
                yield Finding((*path, "time", i), f"times must increase: {data.time[i]:g} follows {data.time[i - 1]:g}")
                break
        if drive and data.interpolation == "linear":
            what = "a drive cannot follow straight lines: its rate would jump"
            yield Finding((*path, "interpolation"), what, "natural, clamped or monotone; smooth the corners in the data")
        if data.end_rates is not None and data.interpolation != "clamped":
            yield Finding((*path, "end_rates"), "only a clamped table has rates at its ends", "add interpolation: clamped")

    def values(self, data: Table, until: float) -> Mapping[str, Sequence[float]]:
        return {"value": data.value}

    def value(self, data: Table, t: float) -> float:
        return interpolated(t, data.time, data.value)

    def travel(self, data: Table, until: float) -> Sequence[float]:
        return [float(v) for v in data.value]
