"""The reference solution: two different methods at tight tolerance, and the distance between their results."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from trunnion.analysis.work_precision.benchmark_model import BenchmarkModel, methods
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.runtime.integrators import REGISTRY, Impulses
from trunnion.simulation.runtime_interface.simulation_block import Settings

TIGHT = (1e-13, 1e-12, 1e-11, 1e-10)
TIME_STEPPING = tuple(m.name for m in REGISTRY if isinstance(m, Impulses))
"""The first-order methods. At tight tolerance they take millions of steps for few digits. They run only if fewer than two other
methods reach the end of the run."""
STEPS = 3_000_000
"""Step limit of a reference run."""


@dataclass(frozen=True)
class Reference:
    """A reference solution. data: samples × compared columns; error: relative distance between the results of the two methods in
    ``made_by``; seconds: stepping time of the longer of the two runs."""

    data: np.ndarray
    error: float
    made_by: str
    seconds: float


@dataclass(frozen=True)
class _ReferenceRun:
    method: str
    rtol: float
    data: np.ndarray
    seconds: float


def find_reference(ready: BenchmarkModel) -> Reference | None:
    """The pair of methods whose results agree best at tight tolerance; None if fewer than two methods reach the end of the run."""
    able = methods(ready.scene)
    tried = [t for m in able if m not in ("auto", *TIME_STEPPING) for t in _tightest_runs(ready, m)]
    if len({t.method for t in tried}) < 2:
        tried += [t for m in able if m in TIME_STEPPING for t in _tightest_runs(ready, m)]
    pairs = [(ready.measure.error(b.data, a.data), a, b) for a, b in combinations(tried, 2) if a.method != b.method]
    if not pairs:
        return None
    error, a, b = min(pairs, key=lambda p: p[0])
    near, far = sorted((a, b), key=lambda t: _median_distance(ready, t, tried))
    return Reference(near.data, error, f"{near.method} at rtol {near.rtol:.0e}, {far.method} at {far.rtol:.0e}",
                     max(near.seconds, far.seconds))


def _tightest_runs(ready: BenchmarkModel, method: str) -> list[_ReferenceRun]:
    """The runs of a method at the two tightest tolerances at which it reaches the end of the run."""
    out: list[_ReferenceRun] = []
    for rtol in TIGHT:
        result, outcome = ready.once(Settings(rtol=rtol, method=method, max_steps=STEPS))
        if result is not None and outcome == "done":
            out.append(_ReferenceRun(method, rtol, ready.samples(result), result.stats.wall_time))
        if len(out) == 2:
            break
    return out


def _median_distance(ready: BenchmarkModel, t: _ReferenceRun, others: list[_ReferenceRun]) -> float:
    """Median distance of run t from the runs of other methods. Of two runs, the one with the smaller median is the better
    reference."""
    return float(np.median([ready.measure.error(o.data, t.data) for o in others if o.method != t.method]))
