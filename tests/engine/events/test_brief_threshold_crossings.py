"""Brief crossings of a threshold. Every method at every tolerance finds a peak slightly above the threshold; a peak slightly below
it causes no event. Closed formulas give the correct events."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.engine.checks.runs_with_host_inputs import HostRun
from tests.reference.scenes.brief_crossing_signals import Shape, ramp, told
from tests.reference.scenes.brief_threshold_crossings import BriefPass, brief_pass
from trunnion import scene_from_dict
from trunnion.simulation.results.result import Result
from trunnion.simulation.results.result_data import Event
from trunnion.simulation.run import simulate

METHODS = ("auto", "rk5", "rk8", "rosenbrock")
RTOLS = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
MOREAU = 1e-6
"""Tolerance of `moreau`, which is of first order."""
FAILED = (21593, 23547, 24280, 5569, 5701, 2, 18, 69, 97, 118, 236, 552, 823, 1378, 1750, 2574, 2739)
"""Seeds of the short test. Their events are easily missed."""
MANY = 1500
"""Seeds of the slow test."""
INACCURATE = ("rosenbrock", 1e-3)
"""Setting in which the audit of energy may be inaccurate, because stiff steps integrate works of drives at this tolerance."""


def time_errors(events: list[Event], method: str, rtol: float) -> list[float]:
    """Allowed errors of the times of a joint's events, relative to the run. Near the top of a peak, an error e of its height
    changes the time at which the peak passes a threshold by up to e/(2√margin). Later events follow this time."""
    if method == "moreau":
        return [10 * math.sqrt(rtol)] * len(events)
    return [100 * rtol + 1e-9 + 0.5 * rtol / math.sqrt(x) for x in np.minimum.accumulate([e.margin for e in events])]


def wrong(case: BriefPass, run: Result | HostRun, method: str, rtol: float) -> list[str]:
    """Differences from the correct result: events, their times (beyond 100 tolerances), and final coordinates (beyond 1,000
    tolerances). `moreau` is of first order: its error is proportional to the root of the tolerance, and its times may differ by ten
    roots."""
    found = []
    for name, part in case.parts.items():
        want, got = case.events(name), [e for e in run.events if e.joint == name and e.kind in part.kinds]
        if [k for k, _ in want] != [e.kind for e in got]:
            found.append(f"{name}: {len(got)} events for {len(want)}")
        elif any(abs(t - e.time) > x * case.until for (_, t), e, x in zip(want, got, time_errors(got, method, rtol), strict=True)):
            found.append(f"{name}: late")
        place = part.place(float(run.time[-1])) if part.place is not None else math.nan
        if abs(run[f"{name}.q[1]"][-1] - place) > 1e-9 + 1e3 * rtol * max(1.0, abs(place)):
            found.append(f"{name}: elsewhere")
    return found


def settings(case: BriefPass, rtols: tuple[float, ...]) -> list[tuple[str, float]]:
    return [(m, x) for m in METHODS for x in rtols if x <= case.loosest] + [("moreau", MOREAU)] * (case.loosest >= MOREAU)


def examined(seed: int, rtols: tuple[float, ...]) -> tuple[int, list[str]]:
    """Number of peaks of a scene in all runs, and the differences from the correct results."""
    case = brief_pass(seed)
    scene = scene_from_dict(case.scene)
    found, peaks = [], 0
    for method, rtol in settings(case, rtols):
        run = simulate(scene, until=case.until, method=method, rtol=rtol, every=case.until, outputs=[f"{n}.q*" for n in case.parts])
        ends = ("done", "inaccurate") if (method, rtol) == INACCURATE else ("done",)
        what = wrong(case, run, method, rtol) if run.outcome.name in ends else [run.outcome.name]
        found += [f"{seed} {method} {rtol:g} {w}" for w in what]
        peaks += sum(max(1, len(case.events(n))) for n in case.parts)
    return peaks, found


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", FAILED)
def test_brief_crossings_are_found_by_every_method(seed: int) -> None:
    assert examined(seed, (1e-3, 1e-5, 1e-7, 1e-9))[1] == []


def test_impulse_steps_find_a_release_beside_a_change_of_another_pair() -> None:
    """A pair is stuck at both ends of a step in which another pair stops. The search covers steps with a change of mode, too."""
    case = brief_pass(4380)
    columns = [f"{n}.q*" for n in case.parts]
    run = simulate(scene_from_dict(case.scene), until=case.until, method="moreau", rtol=MOREAU, every=case.until, outputs=columns)
    assert wrong(case, run, "moreau", MOREAU) == []


def examined_shape(seed: int, shape: Shape, rtols: tuple[float, ...]) -> list[str]:
    """The differences from the correct results in all runs of a scene with signals of a shape."""
    case, found = brief_pass(seed, shape), []
    scene, columns = scene_from_dict(case.scene), [f"{n}.q*" for n in case.parts]
    for method, rtol in settings(case, rtols):
        if case.inputs and method != "moreau":
            what = wrong(case, HostRun(scene, case, method, rtol), method, rtol)
        elif not case.inputs:
            run = simulate(scene, until=case.until, method=method, rtol=rtol, every=case.until, outputs=columns)
            what = wrong(case, run, method, rtol) if run.outcome.name == "done" else [run.outcome.name]
        found += [f"{seed} {method} {rtol:g} {w}" for w in what]
    return found


@pytest.mark.parametrize("shape", [ramp, told], ids=["ramps", "inputs with derivatives"])
def test_passes_by_ramps_and_by_inputs_with_derivatives_are_found(shape: Shape) -> None:
    """Between communication points, an input follows the value and the derivatives that the host declared."""
    assert examined_shape(108, shape, (1e-3, 1e-7)) == []


@pytest.mark.slow
@pytest.mark.parametrize("shape", [ramp, told], ids=["ramps", "inputs with derivatives"])
def test_many_passes_by_ramps_and_by_inputs_with_derivatives_are_found(shape: Shape) -> None:
    assert [w for seed in range(250) for w in examined_shape(seed, shape, (1e-3, 1e-5, 1e-7, 1e-9))] == []


@pytest.mark.slow
def test_many_brief_crossings_are_found_by_every_method_at_every_tolerance() -> None:
    results = [examined(seed, RTOLS) for seed in range(MANY)]
    print(sum(n for n, _ in results), "peaks in all runs;", "wrong:", *(w for _, found in results for w in found), sep="\n")
    assert [w for _, found in results for w in found] == []
