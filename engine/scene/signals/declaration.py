"""Declaration of a kind of signal: its keys in a scene, its expressions, and the times at which a step must end."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, ClassVar, NamedTuple

from trunnion.basics.lazy_casadi import SX
from trunnion.scene.findings.findings_and_paths import Finding, Path

SAMPLES = 1000
"""Number of intervals in which a signal is sampled for checks and notes."""
Triple = tuple[SX, SX, SX]
"""Coordinate, rate and acceleration of a drive."""


class Corner(NamedTuple):
    """A time, s, at which a signal has a corner or jumps. period: time between further occurrences, s; 0: the corner occurs
    once."""

    time: float
    period: float = 0.0


class SignalKind:
    """A kind of signal. ``data`` is the class of its keys, and ``text`` the description of the key.

    labels       kinds of ``system`` signals that this kind becomes, each with its number of leaves (constants or parameters).
    loads        "" if loads may have this kind of signal, else the remedy.
    drives       "" if drives may have this kind of signal, else the reason, then the remedy.
    rates        keys that are rates if the signal is that of a drive."""

    key: ClassVar[str]
    data: ClassVar[type]
    text: ClassVar[str]
    labels: ClassVar[Mapping[str, int]] = {}
    loads: ClassVar[str] = ""
    drives: ClassVar[tuple[str, str] | None] = None
    rates: ClassVar[tuple[str, ...]] = ()

    def signal(self, data: Any, put: Any) -> Any:
        """The signal of ``system``, made by ``put`` (``device_builder.SignalLeaves``)."""
        raise NotImplementedError

    def load(self, sym: Any, s: Any) -> SX:
        """Value at the time ``sym.t``. ``sym.ts`` selects the piece (``recursion.symbolic_inputs``)."""
        raise NotImplementedError

    def motion(self, sym: Any, s: Any) -> Triple:
        """Coordinate, rate and acceleration of a drive."""
        raise NotImplementedError

    def corners(self, data: Any) -> Iterator[Corner]:
        """The times at which a step must end."""
        yield from ()

    def crossings(self, data: Any, level: float) -> Iterator[Corner]:
        """The times at which a load of this kind passes the value ``level`` continuously, not by a jump."""
        yield from ()

    def unlimited(self, data: Any) -> str:
        """"" if the signal may have limits, else the signal's name for the error message."""
        return ""

    def paces(self, s: Any, turns: bool) -> Iterator[tuple[Any, float]]:
        """(leaf, factor to Hz) for parameters that are frequencies, or rotation rates of a drive that turns."""
        yield from ()

    def findings(self, path: Path, data: Any, drive: bool) -> Iterator[Finding]:
        """Mistakes in the keys. path: path of the group of keys."""
        yield from ()

    def values(self, data: Any, until: float) -> Mapping[str, Sequence[float]]:
        """Extreme values of a load, by the scene's keys for these values."""
        raise NotImplementedError

    def value(self, data: Any, t: float) -> float:
        """Value of a load at t, s. At a jump, this is the value after the jump."""
        raise NotImplementedError

    def coordinate(self, data: Any, t: float) -> float:
        """Coordinate of a drive at t, s."""
        raise NotImplementedError

    def travel(self, data: Any, until: float) -> Sequence[float]:
        """Extreme coordinates of a drive from t = 0 to ``until``, s."""
        path = [self.coordinate(data, t) for t in sampled_times(until)]
        return [min(path), max(path)]


def sampled_times(until: float) -> list[float]:
    """Times from 0 to ``until``, s, at which a signal is sampled for checks and notes."""
    return [until * k / SAMPLES for k in range(SAMPLES + 1)]


def interpolated(t: float, times: Sequence[float], values: Sequence[float]) -> float:
    """Linear interpolation at t between values at increasing times. Before the first and after the last time, the value is
    constant."""
    if t >= times[-1]:
        return float(values[-1])
    k = bisect_right(times, t)
    if not k:
        return float(values[0])
    part = (t - times[k - 1]) / (times[k] - times[k - 1])
    return float(values[k - 1] + part * (values[k] - values[k - 1]))
