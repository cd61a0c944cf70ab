"""Rectangular pulses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.basics.lazy_data_classes import validated
from trunnion.scene.data_classes.field_types import STRICT
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.signals.declaration import Corner, SignalKind
from trunnion.scene.signals.step import NO_JUMP
from trunnion.scene.units.numbers_with_units import Duration, Number, Time


@validated(frozen=True, config=STRICT)
class Pulse:
    """A rectangular pulse from ``begin`` to ``begin + duration``, once or with a period."""

    peak: Number
    """Value during the pulse."""
    duration: Duration
    """Duration of the pulse."""
    begin: Time = 0.0
    """Time at which the (first) pulse begins."""
    base: Number = 0.0
    """Value outside the pulse."""
    period: Duration | None = None
    """Time from one pulse to the next; default: a single pulse."""


class PulseKind(SignalKind):
    """Leaves of the signal: base, peak, begin, duration and, for "pulses", period."""

    key, data, text = "pulse", Pulse, "Rectangular pulse, once or with a period."
    labels = {"pulse": 4, "pulses": 5}  # noqa: RUF012
    drives = NO_JUMP

    def signal(self, data: Pulse, put: Any) -> Any:
        often = [] if data.period is None else [put.kink("period", data.period, "s")]
        return put.signal(
            "pulses" if often else "pulse", put.own("base", data.base), put.own("peak", data.peak),
            put.kink("begin", data.begin, "s"), put.kink("duration", data.duration, "s"), *often,
        )

    def load(self, sym: Any, s: Any) -> SX:
        base, peak, begin, duration, *period = (sym.leaf(x) for x in s.leaves)
        since = sym.ts - begin
        inside = since - period[0] * ca.floor(since / period[0]) if period else since
        return ca.if_else(ca.logic_and(since >= 0, inside < duration), peak, base)

    def corners(self, data: Pulse) -> Iterator[Corner]:
        yield from (Corner(data.begin + x, data.period or 0.0) for x in (0.0, data.duration))

    def findings(self, path: Path, data: Pulse, drive: bool) -> Iterator[Finding]:
        if data.period is not None and not data.period > data.duration:
            what = f"the period must be above the duration of a pulse: {data.period:g} is not above {data.duration:g}"
            yield Finding((*path, "period"), what, "omit it for a single pulse")

    def values(self, data: Pulse, until: float) -> Mapping[str, Sequence[float]]:
        return {"": (data.base, data.peak)}

    def value(self, data: Pulse, t: float) -> float:
        since = t - data.begin
        return float(data.peak if since >= 0.0 and (since % data.period if data.period else since) < data.duration else data.base)
