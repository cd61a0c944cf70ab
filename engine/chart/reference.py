"""The solution that errors are measured against: two different methods at tight tolerance that agree, and by how much."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from engine.chart.runs import Prepared, methods
from engine.integrators import REGISTRY, Impulses
from engine.simulation.block import Settings

TIGHT = (1e-13, 1e-12, 1e-11, 1e-10)
TIME_STEPPING = tuple(m.name for m in REGISTRY if isinstance(m, Impulses))
"""Methods of first order take millions of steps at tight tolerance and still agree with others to few digits only: they are
asked only where another method has nothing to be compared with."""
STEPS = 3_000_000
"""Step budget of a reference run."""


@dataclass(frozen=True)
class Reference:
    """data: samples × columns of the compared quantities. error: relative distance between the two methods named in ``made_by``."""

    data: np.ndarray
    error: float
    made_by: str


@dataclass(frozen=True)
class _Try:
    method: str
    rtol: float
    data: np.ndarray


def reference(ready: Prepared) -> Reference | None:
    """The best agreement of two different methods at tight tolerance; None when fewer than two reach the end."""
    tried = [t for m in methods() if m not in ("auto", *TIME_STEPPING) for t in _tight(ready, m)]
    if len({t.method for t in tried}) < 2:
        tried += [t for m in TIME_STEPPING for t in _tight(ready, m)]
    pairs = [(ready.measure.error(b.data, a.data), a, b) for a, b in combinations(tried, 2) if a.method != b.method]
    if not pairs:
        return None
    error, a, b = min(pairs, key=lambda p: p[0])
    near, far = sorted((a, b), key=lambda t: _spread(ready, t, tried))
    return Reference(near.data, error, f"{near.method} at rtol {near.rtol:.0e}, {far.method} at {far.rtol:.0e}")


def _tight(ready: Prepared, method: str) -> list[_Try]:
    """Runs of the method at the two tightest tolerances at which it reaches the end."""
    out: list[_Try] = []
    for rtol in TIGHT:
        result, outcome = ready.once(Settings(rtol=rtol, method=method, max_steps=STEPS))
        if result is not None and outcome == "done":
            out.append(_Try(method, rtol, ready.samples(result)))
        if len(out) == 2:
            break
    return out


def _spread(ready: Prepared, t: _Try, others: list[_Try]) -> float:
    """Median distance from the other methods' runs: the more central of two is the better reference."""
    return float(np.median([ready.measure.error(o.data, t.data) for o in others if o.method != t.method]))
