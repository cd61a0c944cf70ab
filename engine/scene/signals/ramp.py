"""Linear change of a load, or of a drive's rate."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.basics.lazy_data_classes import validated
from trunnion.scene.data_classes.field_types import STRICT
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.signals.declaration import Corner, SignalKind, Triple, interpolated
from trunnion.scene.units.numbers_with_units import Duration, Number, Time


@validated(frozen=True, config=STRICT)
class Ramp:
    """A linear change from ``start`` to ``end`` between ``begin`` and ``begin + duration``. For a load, the value changes; for a
    drive, the rate changes (with q = origin at t = 0)."""

    start: Number
    """Value (drives: rate) before ``begin``."""
    end: Number
    """Value (drives: rate) from ``begin + duration`` on."""
    duration: Duration
    """Duration of the change."""
    begin: Time = 0.0
    """Time at which the change begins."""
    origin: Number = 0.0
    """Drives only: coordinate at t = 0."""


class RampKind(SignalKind):
    """Leaves of the signal: start, end, begin, duration, origin. The label "begun" means a ramp with begin < 0."""

    key, data = "ramp", Ramp
    text = "Linear change from one value to another. In a drive, the values are rates."
    labels = {"ramp": 5, "begun": 5}  # noqa: RUF012
    rates = ("start", "end")

    def signal(self, data: Ramp, put: Any) -> Any:
        return put.signal(
            "begun" if data.begin < 0.0 else "ramp", put.own("start", data.start, put.rate), put.own("end", data.end, put.rate),
            put.kink("begin", data.begin, "s"), put.kink("duration", data.duration, "s"), put.own("origin", data.origin),
        )

    def load(self, sym: Any, s: Any) -> SX:
        start, end, begin, duration, _ = (sym.leaf(x) for x in s.leaves)
        inside = (sym.t - begin) / duration
        return start + (end - start) * ca.if_else(sym.ts < begin, 0, ca.if_else(sym.ts < begin + duration, inside, 1))

    def motion(self, sym: Any, s: Any) -> Triple:
        start, end, begin, duration, origin = (sym.leaf(x) for x in s.leaves)
        slope = (end - start) / duration
        x, before_, during = sym.t - begin, sym.ts < begin, sym.ts < begin + duration

        def added(x: SX, before: SX, during: SX) -> SX:
            """Displacement due to the change of rate. x: time since the beginning of the change."""
            beyond = 0.5 * slope * duration**2 + slope * duration * (x - duration)
            return ca.if_else(before, 0, ca.if_else(during, 0.5 * slope * x * x, beyond))

        position = origin + start * sym.t + added(x, before_, during)
        if s.kind == "begun":
            position -= added(-begin, ca.SX(0), begin + duration >= 0)
        rate = start + slope * ca.if_else(before_, 0, ca.if_else(during, x, duration))
        return position, rate, ca.if_else(before_, 0, ca.if_else(during, slope, 0))

    def corners(self, data: Ramp) -> Iterator[Corner]:
        yield from (Corner(data.begin), Corner(data.begin + data.duration))

    def crossings(self, data: Ramp, level: float) -> Iterator[Corner]:
        if (data.start - level) * (data.end - level) < 0.0:
            yield Corner(data.begin + data.duration * (level - data.start) / (data.end - data.start))

    def paces(self, s: Any, turns: bool) -> Iterator[tuple[Any, float]]:
        yield from ((leaf, 0.5 / math.pi) for leaf in s.leaves[:2] if turns)

    def findings(self, path: Path, data: Ramp, drive: bool) -> Iterator[Finding]:
        if data.origin and not drive:
            yield Finding((*path, "origin"), "origin is for drives: a load has no coordinate", "remove it")

    def values(self, data: Ramp, until: float) -> Mapping[str, Sequence[float]]:
        return {"": (data.start, data.end)}

    def value(self, data: Ramp, t: float) -> float:
        return interpolated(t, (data.begin, data.begin + data.duration), (data.start, data.end))

    def coordinate(self, data: Ramp, t: float) -> float:
        def area(t: float) -> float:
            """Integral of the progress from ``begin`` on."""
            u = min(max((t - data.begin) / data.duration, 0.0), 1.0)
            return data.duration * 0.5 * u * u + max(t - data.begin - data.duration, 0.0)

        return data.origin + data.start * t + (data.end - data.start) * (area(t) - area(0.0))
