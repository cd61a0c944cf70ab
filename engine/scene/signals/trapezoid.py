"""Trapezoids: a linear rise, a constant value, a linear fall."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.basics.lazy_data_classes import validated
from trunnion.basics.number_declarations import NOT_NEGATIVE, Bound
from trunnion.scene.data_classes.field_types import STRICT
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.signals.declaration import Corner, SignalKind, Triple, interpolated
from trunnion.scene.units.numbers_with_units import Duration, Number, Per, Time

Slope = Annotated[float, Per("s", Bound(0.0, open=True, advice="for a jump, use pulse"))]


@validated(frozen=True, config=STRICT)
class Trapezoid:
    """A linear rise from ``base`` to ``peak``, a constant value, and a linear fall back to ``base``, once or with a period. For a
    load, the value changes; for a drive, the rate changes (with q = origin at t = 0)."""

    peak: Number
    """Value (drives: rate) between rise and fall."""
    rise: Slope
    """Duration of the rise."""
    hold: Annotated[float, Per("s", NOT_NEGATIVE)]
    """Duration of the value ``peak``."""
    fall: Slope
    """Duration of the fall."""
    begin: Time = 0.0
    """Time at which the (first) rise begins."""
    base: Number = 0.0
    """Value (drives: rate) before the rise and after the fall."""
    period: Duration | None = None
    """Time from one rise to the next; default: a single trapezoid."""
    origin: Number = 0.0
    """Drives only: coordinate at t = 0."""


class TrapezoidKind(SignalKind):
    """Leaves of the signal: base, peak, begin, rise, hold, fall, origin and, for "trapezoids", period."""

    key, data = "trapezoid", Trapezoid
    text = "Rise, constant value and fall, once or with a period. In a drive, the values are rates."
    labels = {"trapezoid": 7, "trapezoids": 8}  # noqa: RUF012
    rates = ("base", "peak")

    def signal(self, data: Trapezoid, put: Any) -> Any:
        times = [put.kink(key, getattr(data, key), "s") for key in ("begin", "rise", "hold", "fall")]
        often = [] if data.period is None else [put.kink("period", data.period, "s")]
        ends = put.own("base", data.base, put.rate), put.own("peak", data.peak, put.rate)
        return put.signal("trapezoids" if often else "trapezoid", *ends, *times, put.own("origin", data.origin), *often)

    def load(self, sym: Any, s: Any) -> SX:
        base, peak = (sym.leaf(x) for x in s.leaves[:2])
        return base + (peak - base) * self._shape(sym, s, sym.t, sym.ts)[1]

    def motion(self, sym: Any, s: Any) -> Triple:
        base, peak, _, _, _, _, origin, *_ = (sym.leaf(x) for x in s.leaves)
        now, start = (self._shape(sym, s, *times) for times in ((sym.t, sym.ts), (ca.SX(0), ca.SX(0))))
        position = origin + base * sym.t + (peak - base) * (now[0] - start[0])
        return position, base + (peak - base) * now[1], (peak - base) * now[2]

    def _shape(self, sym: Any, s: Any, t: SX, ts: SX) -> Triple:
        """Integral since ``begin``, value and slope at t of the trapezoid with base 0 and peak 1. ts selects the piece."""
        _, _, begin, rise, hold, fall, _, *period = (sym.leaf(x) for x in s.leaves)
        whole, area = rise + hold + fall, rise / 2 + hold + fall / 2
        count = ca.floor((ts - begin) / period[0]) if period else ca.SX(0)
        begun = begin + count * period[0] if period else begin
        u, at = t - begun, ts - begun
        left = whole - u
        pieces = (
            (at < rise, (u * u / (2 * rise), u / rise, 1 / rise)),
            (at < rise + hold, (u - rise / 2, ca.SX(1), ca.SX(0))),
            (at < whole, (area - left * left / (2 * fall), left / fall, -1 / fall)),
        )
        out = [area, ca.SX(0), ca.SX(0)]
        for here, values in reversed(pieces):
            out = [ca.if_else(here, x, rest) for x, rest in zip(values, out, strict=True)]
        out[0] += count * area
        integral, value, slope = (ca.if_else(ts < begin, 0, x) for x in out)
        return integral, value, slope

    def corners(self, data: Trapezoid) -> Iterator[Corner]:
        for x in (0.0, data.rise, data.rise + data.hold, data.rise + data.hold + data.fall):
            yield Corner(data.begin + x, data.period or 0.0)

    def crossings(self, data: Trapezoid, level: float) -> Iterator[Corner]:
        if (data.base - level) * (data.peak - level) < 0.0:
            part, top = (level - data.base) / (data.peak - data.base), data.rise + data.hold
            for x in (part * data.rise, top + (1.0 - part) * data.fall):
                yield Corner(data.begin + x, data.period or 0.0)

    def paces(self, s: Any, turns: bool) -> Iterator[tuple[Any, float]]:
        yield from ((leaf, 0.5 / math.pi) for leaf in s.leaves[:2] if turns)

    def findings(self, path: Path, data: Trapezoid, drive: bool) -> Iterator[Finding]:
        if data.origin and not drive:
            yield Finding((*path, "origin"), "origin is for drives: a load has no coordinate", "remove it")
        whole = data.rise + data.hold + data.fall
        if data.period is not None and data.period < whole:
            what = f"the period must not be below rise + hold + fall: {data.period:g} is below {whole:g}"
            yield Finding((*path, "period"), what, "omit it for a single trapezoid")

    def values(self, data: Trapezoid, until: float) -> Mapping[str, Sequence[float]]:
        return {"": (data.base, data.peak)}

    def value(self, data: Trapezoid, t: float) -> float:
        since = t - data.begin
        at = since % data.period if data.period and since > 0.0 else since
        times = (0.0, data.rise, data.rise + data.hold, data.rise + data.hold + data.fall)
        return data.base + (data.peak - data.base) * interpolated(at, times, (0.0, 1.0, 1.0, 0.0))

    def coordinate(self, data: Trapezoid, t: float) -> float:
        def area(since: float) -> float:
            """Integral of the trapezoid with base 0 and peak 1 over the time since ``begin``."""
            up = max(since, 0.0)
            count = up // data.period if data.period else 0.0
            u = min(up - count * (data.period or 0.0), data.rise + data.hold + data.fall)
            fallen = max(u - data.rise - data.hold, 0.0)
            risen = u * u / (2.0 * data.rise) if u < data.rise else u - data.rise / 2.0
            return count * (data.rise / 2.0 + data.hold + data.fall / 2.0) + risen - fallen * fallen / (2.0 * data.fall)

        return data.origin + data.base * t + (data.peak - data.base) * (area(t - data.begin) - area(-data.begin))
