"""Functions of time: loads (value) and drives (position, rate, acceleration). Also lists with one entry for each freedom."""

from __future__ import annotations

import re

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator


def per_freedom(value, n: int) -> list:
    """A joint's list with one entry for each freedom; a single number stands for the only freedom."""
    if value is None:
        return [None] * n
    if isinstance(value, (tuple, list)):
        if len(value) != n:
            raise ValueError(f"{len(value)} entries for {n} freedoms")
        return list(value)
    if n != 1:
        raise ValueError("a single entry needs a joint of one freedom")
    return [value]


def load_value(scene, load, t: float) -> float:
    """Value of a load: number, input (at its start value) or signal."""
    if load is None:
        return 0.0
    if isinstance(load, (int, float)):
        return float(load)
    if hasattr(load, "input"):
        return float(scene.inputs[load.input].start)
    limit = getattr(load, "limit", None)
    low, high = (None, None) if limit is None else (limit.lower, limit.upper)
    return float(np.clip(_signal_value(load, t), -np.inf if low is None else low, np.inf if high is None else high))


def _signal_value(load, t: float) -> float:
    if load.ramp is not None:
        r = load.ramp
        return r.start + (r.end - r.start) * float(np.clip((t - r.begin) / r.duration, 0.0, 1.0))
    if load.harmonic is not None:
        return _harmonic(load.harmonic, t)[0]
    if load.step is not None:
        return load.step.end if t >= load.step.begin else load.step.start
    if load.pulse is not None:
        p = load.pulse
        return p.peak if 0 <= _since(p, t) < p.duration else p.base
    if load.trapezoid is not None:
        return _trapezoid(load.trapezoid, t)[1]
    if load.expression is not None:
        return float(formula_value(load.expression.formula, {"t": t}))
    table = load.table
    if (table.interpolation or "linear") == "linear":
        return float(np.interp(t, table.time, table.value))
    return float(_curve(table)(np.clip(t, table.time[0], table.time[-1])))


def formula_value(formula: str, at: dict):
    """Value of a formula of a time or a position. Python evaluates the formula without its units, which are SI. at: values of the
    names in it."""
    text = re.sub(r"(?<=\d) ?(N\*m|N/m\^2|N/m|N|1/m|rad/m|rad/s|m|s)(?![\w/])", "", formula).replace("^", "**")
    known = {n: getattr(np, n) for n in ("sin", "cos", "exp", "tanh", "sqrt", "log")} | {"atan": np.arctan}
    return eval(text, known | at)


def _since(signal, t: float) -> float:
    """Time since a signal began, or since its present period began."""
    since = t - signal.begin
    return since % signal.period if signal.period and since > 0 else since


def _trapezoid(s, t: float) -> tuple[float, float, float]:
    """(the integral of a trapezoid from 0 to t, its value, its slope)."""
    ends = np.cumsum([0.0, s.rise, s.hold, s.fall])
    shape = np.array([0.0, 1.0, 1.0, 0.0])

    def area(since: float) -> float:
        """The integral of the trapezoid of height 1 from its beginning up to a time."""
        count, left = divmod(since, s.period) if s.period and since > 0 else (0.0, since)
        knots = np.r_[ends[ends < left], max(left, 0.0)]
        return count * (ends[3] - (s.rise + s.fall) / 2) + float(np.trapezoid(np.interp(knots, ends, shape), knots))

    since = _since(s, t)
    height = s.peak - s.base
    slope = 1 / s.rise if 0 <= since < ends[1] else -1 / s.fall if ends[2] <= since < ends[3] else 0.0
    whole = s.base * t + height * (area(t - s.begin) - area(-s.begin))
    return whole, s.base + height * float(np.interp(since, ends, shape)), height * slope


def drive_motion(drive, t: float) -> tuple[float, float, float]:
    """Prescribed q, its rate and its acceleration (from the right at a kink)."""
    if drive.constant is not None:
        return drive.constant.start + drive.constant.rate * t, drive.constant.rate, 0.0
    if drive.ramp is not None:
        return _ramp(drive.ramp, t)
    if drive.harmonic is not None:
        return _harmonic(drive.harmonic, t)
    if getattr(drive, "trapezoid", None) is not None:
        whole, rate, slope = _trapezoid(drive.trapezoid, t)
        return drive.trapezoid.origin + whole, rate, slope
    if getattr(drive, "move", None) is not None:
        return _moved(drive.move, t)
    if drive.table is None:
        raise NotImplementedError("the reference has no drive that follows an input")
    return _driven(drive.table, t)


def _moved(m, t):
    """A motion from rest to rest: a polynomial of degree 5, or constant acceleration, rate and deceleration for a third of the time
    each."""
    x, way, T = float(np.clip((t - m.begin) / m.duration, 0.0, 1.0)), m.end - m.start, m.duration
    within = m.begin <= t < m.begin + m.duration
    if m.profile == "polynomial":
        shares = x**3 * (10 - 15 * x + 6 * x * x), 30 * x * x * (1 - x) ** 2, 60 * x * (1 - x) * (1 - 2 * x)
    elif m.profile == "trapezoid":
        y = min(x, 1 - x)
        half = 2.25 * y * y if y < 1 / 3 else 1.5 * y - 0.25
        shares = half if x <= 0.5 else 1 - half, min(4.5 * y, 1.5), (4.5 if x < 0.5 else -4.5) * (y < 1 / 3)
    else:
        raise NotImplementedError(f"the reference has no {m.profile} motion")
    return m.start + way * shares[0], way * shares[1] / T, way * shares[2] / T**2 * within


def _harmonic(h, t):
    w = 2 * np.pi * h.frequency
    a = w * t + h.phase
    A = h.amplitude
    return h.offset + A * np.sin(a), A * w * np.cos(a), -A * w * w * np.sin(a)


def _ramp(r, t):
    end = r.begin + r.duration

    def distance(x):  # The integral of the rate from ``begin`` to x.
        if x < r.begin:
            return r.start * (x - r.begin)
        u = min(x, end) - r.begin
        return r.start * u + (r.end - r.start) * u * u / (2 * r.duration) + r.end * max(x - end, 0.0)

    slope = (r.end - r.start) / r.duration if r.begin <= t < end else 0.0
    rate = r.start + (r.end - r.start) * float(np.clip((t - r.begin) / r.duration, 0.0, 1.0))
    return r.origin + distance(t) - distance(0.0), rate, slope


def _curve(table):
    """SciPy's curve through a table (natural unless the table states another)."""
    times, values = np.array(table.time, float), np.array(table.value, float)
    if table.interpolation == "monotone":
        return PchipInterpolator(times, values)
    if table.interpolation == "clamped":
        first, last = table.end_rates or (0.0, 0.0)
        return CubicSpline(times, values, bc_type=((1, first), (1, last)))
    return CubicSpline(times, values, bc_type="natural")


def _driven(table, t):
    times = np.array(table.time, float)
    s = _curve(table)
    inside = min(max(t, times[0]), times[-1])
    rate = float(s(inside, 1))
    bend = float(s(t, 2)) if times[0] <= t < times[-1] else 0.0
    return float(s(inside)) + rate * (t - inside), rate, bend
