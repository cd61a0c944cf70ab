"""Laws that every run of a random mechanism with friction obeys at every setting: energy balance, friction within its cones, one
outcome. A run ends early only where no solution exists. Code outside the engine computes cones and solutions."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np

from tests.reference.contact_and_friction.mode_enumeration import Answer, Decision
from tests.reference.scenes.random_friction_scenes import rubbing
from tests.reference.scenes.random_scenes import Case
from tests.reference.states_from_columns import frictions, state_at, wanted
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate
from trunnion.system.construction.start_values_and_scales import length_scale, rate_scale

SETTINGS = (("auto", 1e-4), ("rk5", 1e-5), ("auto", 1e-6), ("rosenbrock", 1e-6), ("rk8", 1e-8))
"""The default method of runs at a loose and at its usual tolerance, and each method by itself. These runs differ in the ends of
their steps, the states of their stages and the accuracy of the state. Fixed steps and Moreau's impulses locate no event."""
JAMS = ("jammed", "no_solution", "inconsistent")
NO_ANSWER = "no answer"
"""The result for a run that ended with one of these outcomes, if enumeration finds no solution."""
ENERGY, CONE = 1e-3, 1e-6
"""Allowed energy error of a run, relative to the energy converted, and, for a finished run, allowed friction beyond a cone."""
MOST_PAIRS = 8
"""Largest number of pairs at rest for which all combinations of their modes are tried."""
INSTANT = 1e-6
"""Part of the time scale after the last row at which the search for a continuation takes place. Two solutions that meet and vanish
both still exist at the row itself."""
JUMP = 2.0
"""Largest factor by which friction changes over an instant, unless it is about to grow without bound."""
STEPS = 40000
"""Most steps of a run. Explicit methods need many where a pair of several components creeps at a speed near zero."""
SLOW = 1e-8
"""Part of the fastest speed below which a pair counts as at rest at the end of a run."""
ROWS = 40
"""Number of rows of a run whose cones are checked."""


@dataclass(frozen=True)
class Run:
    """One run: its outcome, its energy error relative to the energy converted, and the largest violation of a cone."""

    setting: tuple[str, float]
    result: Result
    energy: float
    cone: float


def time_scale(case: Case) -> float:
    """Seconds: √(length/gravity) of the mechanism."""
    scene = case.scene
    return 1.0 / rate_scale(scene, np.zeros(1), length_scale(scene))


def made(case: Case, setting: tuple[str, float]) -> Run:
    """Run a case for three of its time scales, with a row for each step."""
    method, rtol = setting
    span = 3.0 * time_scale(case)
    r = simulate(case.scene, until=span, every=0, method=method, rtol=rtol, max_steps=STEPS, outputs=wanted(case.scene))
    return Run(setting, r, energy_error(r), broken_cone(r, rtol))


def energy_error(r: Result) -> float:
    """Largest residual of the energy, relative to the energy converted."""
    if not len(r.time):
        return 0.0
    turned = np.ptp(r["energy.kinetic"]) + np.ptp(r["energy.potential"]) + r["energy.dissipated"][-1]
    return float(np.abs(r["energy.residual"]).max() / turned) if turned > 0.0 else 0.0


def broken_cone(r: Result, rtol: float, since: float = 0.0) -> float:
    """Largest relative excess of a pair's friction over its limit, in rows from a time (s) on. A pair that is slower than the
    tolerance may be at rest, so the static coefficient applies to this pair."""
    worst, first = 0.0, int(np.searchsorted(r.time, since))
    for row in np.unique(np.linspace(first, len(r.time) - 1, min(ROWS, len(r.time) - first)).astype(int)):
        decision, eta = Decision(state_at(r, row)), frictions(r, row)
        for p in decision.pairs:
            if np.abs(eta[list(p.places)] / decision.unit[list(p.places)]).max() < 1e-9:
                continue
            slow = p.speed <= 10.0 * rtol * decision.fastest
            load, most = decision.hold(p, p.static if slow else p.mu, eta)
            worst = max(worst, load / most - 1.0)
    return worst


def ways_on(case: Case, r: Result | None) -> list[dict[str, str]] | None:
    """Consistent sets of modes just after the end of a run; at most one is needed. Empty: no solution. None: too many sets to try.
    Without a result: sets at the start."""
    last = -1 if r is None else len(r.time) - 1
    here = Decision(case.state() if r is None else state_at(r, last))
    rest = [p for p in here.pairs if p.speed <= SLOW * here.fastest]
    if len(rest) > MOST_PAIRS:
        return None
    names = {p.name for p in rest}
    found = Decision(here.state, names).answers(1)
    if found and r is not None:
        still = frozenset((p.joint, k) for p in rest for k in p.freedoms)
        later = Decision(state_at(r, last, INSTANT * time_scale(case), still), names).answers(1)
        found = [a for a in later if _bounded(found[0], a)]
    return [a.modes for a in found]


def _bounded(here: Answer, later: Answer) -> bool:
    """True if friction is continuous over an instant. At a dead centre, a pair may stop all other motion. Near a dead centre, the
    friction of this pair is inversely proportional to the distance, which is round-off."""
    first, then = (float(np.abs(a.eta).max(initial=0.0)) for a in (here, later))
    return max(first, then) <= JUMP * min(first, then)


def judged(kind: str, seed: int, settings=SETTINGS) -> tuple[dict[tuple, str], tuple[str, ...]]:
    """Defects of a random mechanism by setting, and the outcomes of its runs. If enumeration also finds no solution, the outcomes
    jammed, inconsistent and no_solution count as equal."""
    case, wrong, ends = rubbing(kind, seed), {}, []
    at_start = lru_cache(partial(ways_on, case))  # the start is the same at every setting
    for setting in settings:
        run = made(case, setting)
        outcome = run.result.outcome
        began = run.result if len(run.result.time) else None
        ways = (ways_on(case, began) if began else at_start(None)) if outcome.name in JAMS else None
        ends.append(NO_ANSWER if ways == [] else outcome.name)
        at = (kind, seed, setting)
        if (outcome.ok or outcome.name in JAMS) and not run.energy <= ENERGY:
            wrong[at] = f"energy off by {run.energy:.1e}"
        elif outcome.ok and not run.cone <= CONE:
            wrong[at] = f"a cone broken by {run.cone:.1e}"
        elif ways:
            wrong[at] = f"{outcome.name} at {outcome.time:g} s, where there is {ways[0]}"
    return wrong, tuple(ends)


def figures(found: dict[int, tuple[dict[tuple, str], tuple[str, ...]]]) -> str:
    """A summary of all seeds: outcomes, whether they agree, and the seeds with defects."""
    ended = Counter(end for _, ends in found.values() for end in ends)
    alike = sum(len(set(ends)) == 1 for _, ends in found.values())
    lines = [f"{len(found)} mechanisms, {alike} end alike at all settings; runs: {dict(ended)}"]
    for seed, (wrong, ends) in found.items():
        lines += [f"{seed}: {', '.join(ends)}"] * (len(set(ends)) > 1) + [f"{at}: {what}" for at, what in wrong.items()]
    return "\n".join(lines)
