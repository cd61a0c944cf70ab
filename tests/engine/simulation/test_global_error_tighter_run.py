"""The error of a run is its difference from a tighter run. The tests check the tolerance, the method and the ends of steps of this
run."""

from __future__ import annotations

import numpy as np
import pytest

from tests.engine.simulation.test_global_error import certain, so_far
from trunnion.runtime.integrators import REGISTRY, Impulses
from trunnion.scene import scene_from_text
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.execution.runnable_model import Model
from trunnion.simulation.global_error.additional_step_ends import offset_step_ends
from trunnion.simulation.global_error.cost_control import CountedRun, PacedRun
from trunnion.simulation.global_error.tighter_run_settings import APART_AT_LEAST, DEARER, FINER, USUAL, companion, higher
from trunnion.simulation.run import simulate
from trunnion.simulation.runtime_interface.simulation_block import Settings

KINKED = """
schema: 1
bodies:
  block: {mass: 1, inertia: [1, 1, 1]}
joints:
  slide:
    {type: prismatic, axis: x, inboard: ground, outboard: block, effort: {table: {time: [0, 0.2, 0.5, 1], value: [0, 1, 0, 1]}}}
"""


def test_the_tighter_run_costs_half_as_much_again_whatever_the_method() -> None:
    for m in REGISTRY:
        tight, _ = companion(Settings(1e-6, m.name), {m.name: 100})
        dearer = DEARER.get(m.name, USUAL)
        assert (1e-6 / tight.rtol) ** (1.0 / m.order) == pytest.approx(dearer)
        fixed, larger = companion(Settings(step=1e-3, method=m.name), {m.name: 100})
        order = m.fixed_order if isinstance(m, Impulses) else m.order
        assert (fixed.step, larger) == pytest.approx((1e-3 / dearer, 1 / (1 - dearer**-order)))
    assert companion(Settings(1e-14), {})[0].rtol > 1e-14


def test_a_run_by_the_stiff_method_is_compared_with_a_far_tighter_one_where_the_scene_is_not_stiff() -> None:
    for method, by in (("rosenbrock", "auto"), ("rk5", "rk8")):
        found = higher(Settings(1e-8, method))
        assert found is not None
        assert (found.method, found.rtol <= 1e-8 / FINER) == (by, True)
    assert all(higher(Settings(1e-8, m)) is None for m in ("rk8", "auto"))
    free = simulate("simple_pendulum", until=10.0, rtol=1e-8, method="rosenbrock", certify=True)
    assert (certain(free).method, certain(free).cost < 2.5) == ("auto", True)
    stiff = sm.Joint("prismatic", "ground", "block", axis="x", damping=1e6, spring=sm.Spring(1e6), start=sm.Start(q=0.1))
    scene = sm.Scene({"block": sm.Body(mass=1.0, inertia=(0.1, 0.1, 0.1))}, {"slide": stiff}, gravity=(0.0, 0.0, 0.0))
    held = simulate(scene, until=2.0, every=0.1, rtol=1e-8, method="rosenbrock", certify=True)
    assert certain(held).method in ("auto", "rosenbrock")  # method auto changes to rosenbrock in this scene
    assert certain(held).cost < 3.0
    fast, slow = np.roots([1.0, 1e6, 1e6])
    true = so_far(held["slide.q[1]"] - 0.1 * (fast * np.exp(slow * held.time) - slow * np.exp(fast * held.time)) / (fast - slow))
    assert np.all(true <= certain(held)["slide.q[1]"])


def test_the_tighter_run_ends_steps_elsewhere_between_kinks_that_are_few_steps_apart() -> None:
    model = Model(scene_from_text(KINKED), ())
    first = CountedRun(model, 1.0, 0.1, Settings(1e-6), None)
    run = first.result()
    other = offset_step_ends(model, 1.0, run, first.times())
    mine, theirs = (m.built.numbers.break_times(1.0) for m in (model, other))
    assert set(mine) < set(theirs)
    added = set(theirs) - set(mine)
    assert all(np.abs(first.times() - t).min() > 1e-9 for t in added)  # the added ends are inside steps of the first run
    assert len(added) <= max(1, 0.3 * run.stats.steps)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("method", ["rk5", "rk8", "rosenbrock"])
@pytest.mark.parametrize("rtol", [1e-5, 1e-8])
def test_a_run_whose_tolerance_follows_its_cost_uses_its_budget_and_stays_tighter(method: str, rtol: float) -> None:
    model = Model(simulate("crank_slider_free", until=0.01).scene, ("*.q*",))
    first = CountedRun(model, 10.0, 0.1, Settings(rtol, method), None)
    run = first.result()
    most = 1.4 * run.stats.rhs_evaluations
    pace = first.pace(run, (most, 10.0 * most), 8 if method == "rk8" else 5, (1e-13, rtol / APART_AT_LEAST))
    second = PacedRun(model, 10.0, 0.1, Settings(rtol / 10.0, method), None, pace=pace)
    assert 0.85 * most < second.result().stats.rhs_evaluations < 1.1 * most
    assert max(second.used) <= rtol / APART_AT_LEAST
    assert not second.cut


def test_a_tighter_run_is_stopped_at_its_limit_and_nothing_is_promised_from_there_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("trunnion.simulation.global_error.two_run_comparison.LIMIT", 0.7)
    monkeypatch.setattr("trunnion.simulation.global_error.two_run_comparison.SMALL", 0)
    r = simulate("crank_slider_free", until=10.0, rtol=1e-8, certify=True)
    p = certain(r).promise
    assert r.outcome.ok
    assert p.why == "cost"
    assert 0.2 < p.until / 10.0 < 0.9
    assert certain(r).cost < 1.8
    assert np.isfinite(certain(r).error[r.time < p.until][:, 0]).all()
