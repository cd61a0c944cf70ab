"""The work and the accuracy of bounded steps (theory, "Bounded steps"). A run reports everything that exceeds a bound."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import trunnion
from tests.reference.scenes.random_friction_scenes import DRY
from tests.reference.scenes.random_scenes import random_loop, random_tree
from trunnion.basics.errors import SceneError
from trunnion.kernel.interface.operation_counts import IMPULSES, ROW
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.settings.realtime_steps import COUNTERS

LEAST = {"evaluations": 1, "iterations": 1, "events": 0}
"""Bounds so low that the fallback makes every step."""
BALL = "spherical_pendulum"


def overruns(counters: Mapping[str, int]) -> dict[str, int]:
    """Bounded steps that reached a limit, by its name."""
    return {kind.name.lower(): counters[name] for kind, name in COUNTERS.items() if counters.get(name)}


def bounded(scene: Any, step: float, until: float, **bounds: Any) -> trunnion.simulation.results.result.Result:
    """A run in bounded steps, with a row at the end of each step."""
    asked = {"simulation.realtime": {"step": step, **bounds}}
    return trunnion.simulate(scene, until=until, every=step, overrides=asked, kernel="parts")


def rough(kind: str, seed: int) -> sm.Scene:
    """A random tree or loop with friction in every joint."""
    made = {"tree": random_tree, "loop": random_loop}[kind]
    return made(f"bounded {seed}", **{**DRY, "loads": True}, bodies=3).scene


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("kind", ["tree", "loop"])
@pytest.mark.parametrize("bounds", [{}, {"evaluations": 12, "iterations": 16}, LEAST], ids=["usual", "tight", "none"])
def test_no_step_takes_more_than_its_static_bound(kind: str, bounds: dict[str, int]) -> None:
    """Random mechanisms with friction in every joint. The test counts evaluations and iterations. The static bound in operations
    follows from these numbers."""
    for seed in range(4):
        run = bounded(rough(kind, seed), 1e-3, 0.05, **bounds)
        pairs = len([e for e in run.names if ".friction.state[" in e])
        asked = run.scene.simulation.realtime
        assert asked is not None
        freedoms = len([n for n in run.names if ".friction.torque[" in n or n.endswith(".friction.force")])
        iterations = asked.iterations or 46 + 8 * freedoms
        assert run.stats.counters["most_evaluations"] <= asked.evaluations + IMPULSES + ROW[0] + 2 * (pairs + 1)
        assert run.stats.counters["most_iterations"] <= iterations + ROW[1] + pairs + 1


def test_steps_within_their_bounds_locate_events_as_the_engine_does() -> None:
    """Example 8.1 has the same events as in the engine's ordinary run. Errors of bounded steps decrease fast with the step between
    events. The engine locates events within a step to 1e-7 of the speed unit."""
    exact = trunnion.simulate(BALL, until=3.0, rtol=1e-11, method="rk8", every=0.1, kernel="parts")
    for step, far in ((4e-3, 1e-5), (1e-3, 1e-8)):
        run = bounded(BALL, step, 3.0)
        assert run.outcome.ok
        assert not overruns(run.stats.counters)
        assert [(e.kind, e.joint) for e in run.events] == [(e.kind, e.joint) for e in exact.events]
        assert np.allclose([e.time for e in run.events], [e.time for e in exact.events], rtol=0, atol=far)
        assert abs(run["pendulum.tip.position[3]"][-1] - exact["pendulum.tip.position[3]"][-1]) <= far


def test_the_fallback_converges_with_the_step() -> None:
    """The fallback makes all steps, with iterations of first order. With a quarter of the step, at most 0.4 of the error remains.
    Friction that reverses inside a step returns at most the energy that friction takes in a step."""
    exact = trunnion.simulate(BALL, until=1.5, rtol=1e-10, every=0.1, kernel="parts")
    errors = []
    for step in (4e-3, 1e-3):
        run = bounded(BALL, step, 1.5, **LEAST)
        assert run.outcome.ok
        taken = np.diff(run["energy.dissipated"])
        assert taken.min() > -taken.max()
        errors.append(abs(run["pendulum.tip.position[3]"][-1] - exact["pendulum.tip.position[3]"][-1]))
    assert errors[0] < 0.02
    assert errors[1] < 0.4 * errors[0]


def test_an_exceeded_bound_is_reported_by_name() -> None:
    """A column, counters and a note report every exceeded bound."""
    for bounds in (LEAST, {"events": 0}, {"iterations": 30}):
        run = bounded(BALL, 1e-3, 1.2, **bounds)
        told = overruns(run.stats.counters)
        assert told
        count = run["realtime.overruns"]
        assert count[-1] == sum(told.values())
        steps_over = np.flatnonzero(np.diff(count)) + 1
        assert np.all(run["realtime.overrun"][steps_over] > 0)
        assert np.count_nonzero(run["realtime.overrun"]) == len(steps_over)
        assert any("bounded steps" in n for n in run.notes)


def test_a_jam_is_passed_by_impulses_and_reported() -> None:
    """Example 8.3 with a short guide ends as jammed in ordinary runs. A run in real-time steps continues and reports the jam."""
    jam = {"joints.guide.friction.half_length": 0.22}
    asked = {"simulation.realtime": {"step": 1e-3}, **jam}
    run = trunnion.simulate("double_pendulum", until=3.2, every=0.1, overrides=asked, kernel="parts")
    assert run.outcome.ok or run.outcome.name == "inaccurate"
    assert overruns(run.stats.counters)


def test_a_scene_without_bounds_has_no_columns_and_counters_of_bounded_steps() -> None:
    """A run without bounds must not have columns and counters of bounded steps."""
    run = trunnion.simulate(BALL, until=0.1, kernel="parts")
    assert not run.matching("realtime.*")
    assert run.stats.counters["most_evaluations"] == 0


def test_settings_that_bounded_steps_cannot_obey_are_refused_with_a_remedy() -> None:
    """One error names all conflicts: a stiff law, a method without bound, another step, rows between steps."""
    scene = replace(trunnion.load_scene(BALL), friction=sm.FrictionDefaults(law="regularized", v_eps=1e-4))
    asked = {"simulation.realtime": {"step": 1e-3}}
    with pytest.raises(SceneError) as refused:
        trunnion.simulate(scene, until=1.0, every=1.5e-3, step=2e-3, method="rosenbrock", overrides=asked)
    where = {p.where for p in refused.value.problems}
    assert {"simulation.realtime", "method", "step", "every"} <= where
    assert all(p.hint for p in refused.value.problems)
