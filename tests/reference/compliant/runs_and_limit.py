"""Runs of the compliant model at several levels of stiffness. Extrapolation gives the limit of stiff joints."""

from __future__ import annotations

import fnmatch
import time
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tests.reference.compliant.equations_of_motion import Model
from tests.reference.compliant.joint_sides_from_poses import resolved
from tests.reference.compliant.joint_springs_and_friction import Level
from tests.reference.compliant.radau import Run, polynomial
from tests.reference.compliant.start_state import rest_together, start
from tests.reference.compliant.unilateral_contacts import SOFTER

FASTEST = 1e4
"""Angular frequency of the heaviest body on one contact spring at level 0, rad/s."""
DELAYS = 10.0
"""Damping: the delay of the springs times FASTEST, at level 0. The delay falls with the compliance, so that all errors have the
same order: in a bearing whose parts turn at the rate w, the delay rotates the displacement by the angle w x delay against its
force, which changes the shares of loads."""
REST = 3e-6
"""Rate below which friction rests at level 0, rad/s. The corresponding speed, m/s, is a tenth of this number. Below this rate,
friction relaxes the loads of springs within the time friction / (rate x stiffness), equally at all levels. At 3e-4 this time would
be milliseconds, and trains at rest would slip 1 ms early."""
FINER = 4.0
"""Ratio of two levels, in compliance and in speeds."""
LEVELS = 3
NUDGE = 2000
"""Speed of rest relative to the step of finite differences. Differences across the kink of the law at this speed would mislead
Newton's method."""
BEGUN = 2e-6
"""Longest step, s, in which a pair may leave its speed of rest while another pair is about to slide."""
SETTLED = 5.0
"""Time after the start, or after a kink of a signal, at which the pairs that such a jolt moved may rest again, in delays. At the
start no spring is loaded. While the springs take their loads, pairs at rest pass the speed at which they begin to slide."""
SAMPLES = 9
"""Number of states of a step at which the run looks for changes of hooks and pairs."""
BEFORE = 1e-12
"""Part of the time before a jump of a signal at which a step ends. The step then uses no value after the jump."""
ENOUGH = 1e-6
"""If the first two levels differ by less than this, no third level is run."""


@dataclass(frozen=True)
class Judged:
    """The limit. time: instants; values: {column: value at each instant}; error: {column: error at each instant}; seconds:
    computing time; levels: the runs at each level."""

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
    """The stiffness and speeds of a level. Contacts that begin and end are softer than joints by ``SOFTER``; the stiffness
    of joints is raised by as much."""
    heaviest = max(p.mass for p in _parts(scene).values())
    finer = FINER**number
    frequency = FASTEST * np.sqrt(finer)
    softer = SOFTER if _has_contacts(scene) else 1.0
    return Level(heaviest * frequency**2 / softer, DELAYS / FASTEST / finer, 0.1 * REST / finer, REST / finer)


def _parts(scene):
    from tests.reference.mechanics.bodies_and_joint_frames import parts

    return parts(scene)


def judged(scene, until: float | None = None, outputs=("*",), instants: int = 10, rates: dict | None = None, rtol: float = 1e-7,
           levels: int = LEVELS) -> Judged:  # fmt: skip
    """The motion of a scene in the limit of stiff joints and exact friction.

    ``outputs``: patterns of ``JOINT.q[k]``, ``JOINT.qd[k]``, ``energy.dissipated``. ``rates``: start rates of all joints, used
    where the scene leaves rates open. NotJudged names the features that the model does not support."""
    clock = time.process_time()
    end = scene.simulation.until if until is None else until
    times = np.linspace(0, end, instants + 1)
    plain, runs, steps = resolved(scene), [], 0
    for number in range(levels):
        run, count = table(plain, level_of(plain, number), times, rates, rtol)
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


def _has_contacts(scene) -> bool:
    """Whether a scene has contacts that begin and end."""
    return any(j.unilateral is not None for j in scene.joints.values())


def _literal(pattern: str) -> str:
    """A pattern in which brackets are literal."""
    return pattern.replace("[", "[[]")


def table(scene, level: Level, times, rates: dict | None = None, rtol: float = 1e-7) -> tuple[dict[str, np.ndarray], int]:
    """One run at one level: columns at the given instants, and its number of steps."""
    model = Model(scene, level)
    y = start(model, rates)
    if model.has_jumps:
        rest_together(model, y)
    model.begin(y)
    f = model.frames
    atol, rtols = np.full(f.size, 1e-8), np.full(f.size, rtol)
    if _has_contacts(scene):  # joints are stiffer, so that the same error of positions is a larger error of forces
        for key in ("c", "q"):
            atol[f.at[key]] *= SOFTER
            rtols[f.at[key]] *= SOFTER
    atol[f.at["v"]], atol[f.at["w"]] = level.speed / 10, level.rate / 10
    atol[f.at["taken"]] = 1e-7
    nudge = np.full(f.size, 1e-9)
    nudge[f.at["v"]], nudge[f.at["w"]] = level.speed / NUDGE, level.rate / NUDGE
    run = Run(model.rates, 0.0, y, rtols, atol, nudge)
    rows, labels = [_row(model, y)], _labels(model)
    left: dict[int, tuple[float, np.ndarray]] = {}
    kinks = set(model.kinks(float(times[-1])))
    calm = {t + SETTLED * level.delay for t in (0.0, *kinks)} if model.has_jumps else set()
    for mark in sorted({*kinks, *map(float, times[1:]), *(t for t in calm if t < times[-1])}):
        end = mark * (1 - BEFORE) if mark in kinks else mark
        while run.t < end:
            _advance(model, run, end, left)
        if mark in kinks:
            run.t = mark
            run.restart(1e-4)
        if mark in calm:
            model.rest_again(run.t, run.y)
            left.update(dict.fromkeys(left, (run.t, run.y)))
        if any(mark == t for t in times):
            rows.append(_row(model, run.y))
    return dict(zip(labels, np.array(rows).T, strict=True)), run.steps


def _labels(model: Model) -> list[str]:
    numbers = [f"{n}.q[{k + 1}]" for n, k in model.free.labels]
    return [*numbers, *(f"{n}.qd[{k + 1}]" for n, k in model.free.labels), "energy.dissipated"]


def _row(model: Model, y: np.ndarray) -> np.ndarray:
    q, qd, _, _ = model.free.coordinates(model.frames.motion(np.zeros(1), y[None]))
    return np.concatenate([q[0], qd[0], [y[model.frames.at["taken"]]]])


def _advance(model: Model, run: Run, mark: float, left: dict) -> None:
    """A step that ends at the first change of a discrete state in the step. left: for each moving pair, the instant and state at
    which the pair left its speed of rest."""
    t0, y0, stages = run.step(mark)
    if model.has_switches:
        h = run.t - t0
        shares = np.linspace(0, 1, SAMPLES)
        seen = _functions(model, t0, h, y0, stages, shares)
        moving = model.moving(SAMPLES) if model.has_jumps else np.zeros((SAMPLES, 0), bool)
        below = np.flatnonzero((seen[1:] < 0).any(axis=1))
        last = below[0] + 1 if len(below) else SAMPLES - 1
        if h > BEGUN and model.yields and (moving[last] & ~moving[: last + 1].all(axis=0)).any():
            # repeat the interval with shorter steps, because the step's polynomial does not place the kink of a law exactly
            run.t, run.y, run.h = t0, y0, h / 4
            return
        _note(model, (t0, h, y0, stages), shares, moving[: last + 1], left)
        if len(below):
            share, k = _located(model, t0, h, y0, stages, shares[last - 1], shares[last])
            run.t, run.y = t0 + share * h, y0 + polynomial(stages, np.array([share]))[0]
            for late in [i for i, (t, _) in left.items() if t > run.t]:  # noted after the instant at which the step now ends
                del left[late]
            pair = model.switch(k, run.t, run.y)
            # go back to the latest instant at which a pair that began to move with this pair left its speed of rest
            if pair in left:
                run.t, run.y = max((x for x in left.values() if left[pair][0] <= x[0] <= run.t), key=lambda x: x[0])
            run.restart(1e-5)
    _tidy(model, run)


def _note(model: Model, step: tuple, shares: np.ndarray, moving: np.ndarray, left: dict) -> None:
    """Store the instants and states at which pairs leave their speed of rest."""
    t0, h, y0, stages = step
    for pair in range(moving.shape[1]):
        if not moving[-1, pair]:
            left.pop(pair, None)
        elif not moving[:, pair].all():
            k = int(np.flatnonzero(~moving[:, pair])[-1])
            a, b = shares[k], shares[k + 1]
            while b - a > 1e-3:
                c = (a + b) / 2
                _functions(model, t0, h, y0, stages, c)
                a, b = (a, c) if model.moving(1)[0, pair] else (c, b)
            left[pair] = (t0 + b * h, y0 + polynomial(stages, np.array([b]))[0])


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
    """Normalise quaternions, and store the angles near which coordinates are continued."""
    f = model.frames
    q = run.y[f.at["q"]].reshape(-1, 4)
    run.y = run.y.copy()
    run.y[f.at["q"]] = (q / np.linalg.norm(q, axis=1)[:, None]).reshape(-1)
    model.free.near = model.free.coordinates(f.motion(np.array([run.t]), run.y[None]))[0][0]
