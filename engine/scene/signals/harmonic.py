"""A signal that is a sine of the time."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.basics.lazy_data_classes import validated
from trunnion.basics.number_declarations import Bound
from trunnion.scene.data_classes.field_types import STRICT
from trunnion.scene.signals.declaration import Corner, SignalKind, Triple
from trunnion.scene.units.numbers_with_units import Angle, Number, Per


@validated(frozen=True, config=STRICT)
class Harmonic:
    """A sine: offset + amplitude sin(2 pi frequency t + phase)."""

    amplitude: Number
    """Amplitude, half of the peak-to-peak value."""
    frequency: Annotated[float, Per("Hz", Bound(0.0, advice="for the opposite sign, add 180 deg to the phase"))]
    """Cycles per second."""
    phase: Angle = 0.0
    """Phase at t = 0."""
    offset: Number = 0.0
    """Mean value."""


class HarmonicKind(SignalKind):
    """Leaves of the signal: amplitude, frequency, phase, offset."""

    key, data, text = "harmonic", Harmonic, "Sine."
    labels = {"harmonic": 4}  # noqa: RUF012

    def signal(self, data: Harmonic, put: Any) -> Any:
        return put.signal(
            "harmonic", put.own("amplitude", data.amplitude), put.own("frequency", data.frequency, "Hz"),
            put.own("phase", data.phase, "rad"), put.own("offset", data.offset),
        )

    def load(self, sym: Any, s: Any) -> SX:
        return self.motion(sym, s)[0]

    def motion(self, sym: Any, s: Any) -> Triple:
        amplitude, frequency, phase, offset = (sym.leaf(x) for x in s.leaves)
        w = 2 * ca.pi * frequency
        sin, cos = ca.sin(w * sym.t + phase), ca.cos(w * sym.t + phase)
        return offset + amplitude * sin, amplitude * w * cos, -amplitude * w * w * sin

    def crossings(self, data: Harmonic, level: float) -> Iterator[Corner]:
        if not abs(level - data.offset) < abs(data.amplitude) or not data.frequency:
            return
        angle, period = math.asin((level - data.offset) / data.amplitude), 1.0 / data.frequency
        for at in (angle, math.pi - angle):
            first = (at - data.phase) / (2.0 * math.pi) * period
            yield Corner(first - period * math.ceil(first / period + 0.5), period)

    def paces(self, s: Any, turns: bool) -> Iterator[tuple[Any, float]]:
        yield s.leaves[1], 1.0

    def values(self, data: Harmonic, until: float) -> Mapping[str, Sequence[float]]:
        return {"": (data.offset - abs(data.amplitude), data.offset + abs(data.amplitude))}

    def value(self, data: Harmonic, t: float) -> float:
        return data.offset + data.amplitude * math.sin(2.0 * math.pi * data.frequency * t + data.phase)

    def travel(self, data: Harmonic, until: float) -> Sequence[float]:
        return self.values(data, until)[""]
