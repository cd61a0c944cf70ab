"""The run that a run is compared with for its error: how much tighter, by which method, and where its steps end."""

from __future__ import annotations

import numpy as np
import pytest

from engine.integrators import REGISTRY, Impulses
from engine.scene import model as sm
from engine.scene import scene_from_text
from engine.simulation.block import Settings
from engine.simulation.certainty.companion import DEARER, FINER, USUAL, companion, elsewhere, explicit
from engine.simulation.model import Model
from engine.simulation.run import simulate
from tests.engine.test_certainty import certain, so_far

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
    found = explicit(Settings(1e-8, "rosenbrock"))
    assert found is not None
    assert (found[0].method, found[0].rtol <= 1e-8 / FINER) == ("rk8", True)
    assert all(explicit(Settings(1e-8, m)) is None for m in ("rk5", "rk8", "auto"))
    free = simulate("simple_pendulum", until=10.0, rtol=1e-8, method="rosenbrock", certify=True)
    assert (certain(free).method, certain(free).cost < 2.5) == ("rk8", True)
    stiff = sm.Joint("prismatic", "ground", "block", axis="x", damping=1e6, spring=sm.Spring(1e6), start=sm.Start(q=0.1))
    scene = sm.Scene({"block": sm.Body(mass=1.0, inertia=(0.1, 0.1, 0.1))}, {"slide": stiff}, gravity=(0.0, 0.0, 0.0))
    held = simulate(scene, until=2.0, every=0.1, rtol=1e-8, method="rosenbrock", certify=True)
    assert certain(held).method == "rosenbrock"
    assert certain(held).cost < 3.0
    fast, slow = np.roots([1.0, 1e6, 1e6])
    true = so_far(held["slide.q[1]"] - 0.1 * (fast * np.exp(slow * held.time) - slow * np.exp(fast * held.time)) / (fast - slow))
    assert np.all(true <= certain(held)["slide.q[1]"])


def test_the_tighter_run_ends_steps_elsewhere_between_kinks_that_are_few_steps_apart() -> None:
    model = Model(scene_from_text(KINKED), ())
    other = elsewhere(model, 1.0, 12)
    mine, theirs = model.built.numbers.breaks, other.built.numbers.breaks
    assert set(mine) < set(theirs)
    assert elsewhere(model, 1.0, 1000) is model  # many steps in between: they go apart by themselves
