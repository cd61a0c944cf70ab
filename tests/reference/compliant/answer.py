"""Runs of the compliant model, and its limit from several of them."""

from __future__ import annotations

import fnmatch
import time
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tests.reference.compliant.fits import Level
from tests.reference.compliant.model import Model
from tests.reference.compliant.placed_scenes import resolved
from tests.reference.compliant.radau import Run, polynomial
from tests.reference.compliant.start import start

FASTEST = 1e4
"""Angular frequency of the heaviest body on one contact spring at level 0, rad/s."""
DELAYS = 10.0
"""Damping: the delay of the springs times that frequency."""
REST = 3e-6
"""Rate below which friction rests at level 0, rad/s; the speed is a tenth of it, m/s. Friction below it relaxes the loads of
springs within friction / (rate x stiffness), equally at all levels. At 3e-4 this time was milliseconds, and trains at rest slipped
1 ms early."""
FINER = 4.0
"""Ratio of two levels, in compliance and in speeds."""
LEVELS = 3
SAMPLES = 9
"""Number of states of a step at which the run looks for changes of hooks and pairs."""
ENOUGH = 1e-6
"""Difference of the first two levels below which no third level is run."""


@dataclass(frozen=True)
class Judged:
    """The limit. time: instants; values: {column: value at each instant}; error: {column: how sure, at each instant}; seconds: of
    computing; levels: the runs themselves."""

    time: np.ndarray
    values: dict[str, np.ndarray]
    error: dict[str, np.ndarray]
    seconds: float
    levels: list[dict[str, np.ndarray]]
    steps: int

    @property
    def worst(self) -> float:
        """The largest error of all columns and instants."""
        return max(float(e.max()) for e in self.error.values())


def level_of(scene, number: int) -> Level:
    """The stiffness and speeds of a level."""
    heaviest = max(p.mass for p in _parts(scene).values())
    finer = FINER**number
    frequency = FASTEST * np.sqrt(finer)
    return Level(heaviest * frequency**2, DELAYS / frequency, 0.1 * REST / finer, REST / finer)


def _parts(scene):
    from tests.reference.mechanics.body_properties import parts

    return parts(scene)


def judged(scene, until: float | None = None, outputs=("*",), instants: int = 10, start_from=None, rtol: float = 1e-7,
           levels: int = LEVELS) -> Judged:  # fmt: skip
    """The motion of a scene in the limit of stiff joints and exact friction.

    ``outputs``: patterns of ``JOINT.q[k]``, ``JOINT.qd[k]``, ``energy.dissipated``. ``start_from``: (q, qd) of joints. NotJudged
    names the features that the model does not support."""
    clock = time.process_time()
    end = scene.simulation.until if until is None else until
    times = np.linspace(0, end, instants + 1)
    plain, runs, steps = resolved(scene), [], 0
    for number in range(levels):
        run, count = table(plain, level_of(plain, number), times, start_from, rtol)
        names = [n for n in run if any(fnmatch.fnmatchcase(n, _literal(p)) for p in outputs)]
        runs.append({n: run[n] for n in names})
        steps += count
        if number == 1 and max(float(np.abs(runs[1][n] - runs[0][n]).max()) for n in names) < ENOUGH:
            break
    values, error = {}, {}
    for n in runs[0]:
        rows = [r[n] for r in runs]
        limits = [b + (b - a) / (FINER - 1) for a, b in pairwise(rows)]
        values[n] = limits[-1]
        error[n] = np.abs(limits[-1] - limits[-2]) if len(limits) > 1 else np.abs(rows[-1] - rows[-2])
    return Judged(times, values, error, time.process_time() - clock, runs, steps)


def _literal(pattern: str) -> str:
    """A pattern in which brackets are literal."""
    return pattern.replace("[", "[[]")


def table(scene, level: Level, times: np.ndarray, start_from=None, rtol: float = 1e-7) -> tuple[dict[str, np.ndarray], int]:
    """One run at one level: columns at the given instants, and its number of steps."""
    model = Model(scene, level)
    y = start(model, *(start_from or (None, None)))
    model.begin(y)
    f = model.frames
    atol = np.full(f.size, 1e-8)
    atol[f.at["v"]], atol[f.at["w"]] = level.speed / 10, level.rate / 10
    atol[f.at["taken"]] = 1e-7
    nudge = np.full(f.size, 1e-9)
    nudge[f.at["v"]], nudge[f.at["w"]] = level.speed / 20, level.rate / 20
    run = Run(model.rates, 0.0, y, rtol, atol, nudge)
    rows, labels = [_row(model, y)], _labels(model)
    kinks = set(model.kinks(float(times[-1])))
    for mark in sorted({*kinks, *map(float, times[1:])}):
        while run.t < mark:
            _advance(model, run, mark)
        if mark in kinks:
            run.restart(1e-4)
        if any(mark == t for t in times):
            rows.append(_row(model, run.y))
    return dict(zip(labels, np.array(rows).T, strict=True)), run.steps


def _labels(model: Model) -> list[str]:
    numbers = [f"{n}.q[{k + 1}]" for n, k in model.free.labels]
    return [*numbers, *(f"{n}.qd[{k + 1}]" for n, k in model.free.labels), "energy.dissipated"]


def _row(model: Model, y: np.ndarray) -> np.ndarray:
    q, qd, _, _ = model.free.seen(model.frames.motion(np.zeros(1), y[None]))
    return np.concatenate([q[0], qd[0], [y[model.frames.at["taken"]]]])


def _advance(model: Model, run: Run, mark: float) -> None:
    """A step, shortened to the first change of a state in it."""
    t0, y0, stages = run.step(mark)
    if model.has_switches:
        h = run.t - t0
        shares = np.linspace(0, 1, SAMPLES)
        seen = _functions(model, t0, h, y0, stages, shares)
        below = np.flatnonzero((seen[1:] < 0).any(axis=1))
        if len(below):
            share, k = _located(model, t0, h, y0, stages, shares[below[0]], shares[below[0] + 1])
            run.t, run.y = t0 + share * h, y0 + polynomial(stages, np.array([share]))[0]
            model.switch(k, run.t, run.y)
            run.restart(1e-5)
    _tidy(model, run)


def _functions(model, t0, h, y0, stages, shares) -> np.ndarray:
    shares = np.atleast_1d(shares)
    return model.switches(t0 + shares * h, y0 + polynomial(stages, shares))


def _located(model, t0, h, y0, stages, a: float, b: float) -> tuple[float, int]:
    """The share of the step at which the first function has just become negative, and its number."""
    while b - a > 1e-12:
        shares = np.linspace(a, b, SAMPLES)
        first = int(np.argmax((_functions(model, t0, h, y0, stages, shares[1:-1]) < 0).any(axis=1)))
        if not (_functions(model, t0, h, y0, stages, shares[first + 1])[0] < 0).any():
            first = SAMPLES - 2
        a, b = shares[first], shares[first + 1]
    return b, int(np.argmin(_functions(model, t0, h, y0, stages, b)[0]))


def _tidy(model: Model, run: Run) -> None:
    """Unit quaternions, and angles to continue from."""
    f = model.frames
    q = run.y[f.at["q"]].reshape(-1, 4)
    run.y = run.y.copy()
    run.y[f.at["q"]] = (q / np.linalg.norm(q, axis=1)[:, None]).reshape(-1)
    model.free.near = model.free.seen(f.motion(np.array([run.t]), run.y[None]))[0][0]
