"""Signals with brief threshold crossings: harmonics, tables, ramps, and inputs that a host declares with derivatives. All signals
have a closed form."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq


@dataclass(frozen=True)
class Signal:
    """A signal: its description in a scene, its function, and times that bracket its maxima and crossings."""

    data: Any
    value: Callable[[float], float]
    marks: tuple[float, ...]
    pieces: tuple[tuple[float, tuple[float, float, float]], ...] = ()
    """For an input: the times at which a host declares it, with its value and first two derivatives."""

    def crossings(self, level: float, until: float) -> list[tuple[float, int]]:
        """Times at which the signal crosses a level, with +1 (rising) or -1."""
        marks = [0.0, *(t for t in self.marks if 0.0 < t < until), until]
        found = []
        for a, b in pairwise(marks):
            f, g = self.value(a) - level, self.value(b) - level
            if (f > 0.0) != (g > 0.0):
                found.append((brentq(lambda t: self.value(t) - level, a, b, xtol=1e-15, rtol=1e-14), 1 if g > 0.0 else -1))
        return found


def log_uniform(r: np.random.Generator, low: float, high: float) -> float:
    return float(10 ** r.uniform(low, high))


def harmonic(r: np.random.Generator, low: float, high: float, span: float, middle: float | None = None) -> Signal:
    """A harmonic between two values, with periods from a tenth of a span to three spans. middle: time of a maximum."""
    f = float(log_uniform(r, -0.5, 1.0) / span)
    at = float(r.uniform(0.0, 1.0) / f) if middle is None else middle
    phase = 0.5 * math.pi - 2 * math.pi * f * at
    offset, amplitude = 0.5 * (high + low), 0.5 * (high - low)
    # cos x = 1 - 2 sin^2(x/2) keeps the digits of the distance from the maximum
    value = lambda t: high - 2 * amplitude * math.sin(math.pi * f * (t - at)) ** 2  # noqa: E731
    first = at - math.ceil(at * f) / f
    marks = tuple(first + 0.5 * i / f for i in range(int(2 * (3 * span) * f) + 8))
    data = {"harmonic": {"amplitude": amplitude, "frequency": f, "phase": phase, "offset": offset}}
    return Signal(data, value, marks)


def spline_marks(spline: CubicSpline, times: np.ndarray) -> tuple[float, ...]:
    turns = [float(t) for t in spline.derivative().roots(extrapolate=False) if times[0] < t < times[-1]]
    return tuple(sorted([*times, *turns]))


def table(r: np.random.Generator, low: float, high: float, span: float, middle: float | None = None) -> Signal:
    """Straight lines or a natural spline that rise from a low to a high value, and fall again."""
    at = float(r.uniform(0.3, 0.7) * span) if middle is None else middle
    width = float(r.uniform(0.02, 0.25)) * at
    if r.random() < 0.5:
        times = np.array([0.0, at - width, at, at + width * r.uniform(0.5, 2.0), 10 * span + 2 * at])
        values = np.array([low, low, high, low, low])
        data = {"table": {"time": times.tolist(), "value": values.tolist(), "interpolation": "linear"}}
        return Signal(data, lambda t: float(np.interp(t, times, values)), tuple(times))
    times = at + width * np.arange(-2, 3)
    shape = np.array([0.0, 0.1, 1.0, 0.2, 0.0])
    spline = CubicSpline(times, shape, bc_type="natural")
    top = max(spline(t) for t in spline_marks(spline, times))
    values = low + (high - low) * shape / top
    spline = CubicSpline(times, values, bc_type="natural")
    value = lambda t: float(spline(min(max(t, times[0]), times[-1])))  # noqa: E731
    data = {"table": {"time": times.tolist(), "value": values.tolist(), "interpolation": "natural"}}
    return Signal(data, value, spline_marks(spline, times))


def ramp(r: np.random.Generator, low: float, high: float, span: float, _: float | None = None) -> Signal:
    """A rise from a low to a high value."""
    begin, duration = float(r.uniform(0.05, 0.5)) * span, log_uniform(r, -3.0, -0.35) * span
    data = {"ramp": {"start": low, "end": high, "begin": begin, "duration": duration}}
    return Signal(data, lambda t: float(np.interp(t, [begin, begin + duration], [low, high])), (begin, begin + duration))


def told(r: np.random.Generator, low: float, high: float, span: float, _: float | None = None) -> Signal:
    """An input that a host declares with derivatives at some times. It is a parabola with its peak between two of these times,
    followed by a line back to the low value."""
    begin, after, peak = float(r.uniform(0.05, 0.5)) * span, log_uniform(r, -2.0, -0.7) * span, float(r.uniform(0.5, 0.95))
    top, bend = peak * after, 2.0 * (high - low) / (peak * after) ** 2
    last = high - 0.5 * bend * (after - top) ** 2
    pieces = (
        (0.0, (low, 0.0, 0.0)), (begin, (low, bend * top, -bend)),
        (begin + after, (last, (low - last) / after, 0.0)), (begin + 2 * after, (low, 0.0, 0.0)),
    )  # fmt: skip

    def value(t: float) -> float:
        at, (u, v, w) = max((p for p in pieces if p[0] <= t), key=lambda p: p[0])
        return u + (t - at) * (v + 0.5 * w * (t - at))

    return Signal({"input": f"u{r.integers(1 << 40)}"}, value, (begin, begin + top, begin + after, begin + 2 * after), pieces)


def upside_down(s: Signal) -> Signal:
    """The signal with the opposite sign."""
    kind, data = next(iter(s.data.items()))
    if kind == "input":
        return Signal(s.data, lambda t: -s.value(t), s.marks, tuple((t, (-u, -v, -w)) for t, (u, v, w) in s.pieces))
    names = {"harmonic": ("amplitude", "offset"), "ramp": ("start", "end")}.get(kind, ("value",))
    turned = {n: [-x for x in v] if isinstance(v, list) else -v if n in names else v for n, v in data.items() if n in names}
    return Signal({kind: data | turned}, lambda t: -s.value(t), s.marks)


def peaked(r: np.random.Generator, low: float, high: float, span: float) -> Signal:
    return (harmonic if r.random() < 0.5 else table)(r, low, high, span)


Shape = Callable[..., Signal]
