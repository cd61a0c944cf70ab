"""Every case of a sweep has a budget of time and of steps. A case that never ends gives a row with a named outcome, and does not
change the other cases."""

from __future__ import annotations

import pytest

import trunnion
from trunnion.batch.cases.grids_and_samples import listed
from trunnion.batch.plan_and_runner import Runner, plan
from trunnion.simulation.settings.run_settings import Run

MU, END = "joints.ball.friction.mu", "simulation.until"
NEVER = 1e9
"""End time of a case, s, that no machine reaches within its CPU-time limit."""
CASES = [{MU: 0.2, END: 0.1}, {MU: 0.3, END: NEVER}, {MU: 0.4, END: 0.2}]


@pytest.mark.parametrize("kernel", ["parts", "compiled"])
def test_a_case_that_never_ends_is_out_of_time_and_the_others_are_as_without_it(kernel: str) -> None:
    kept = ["final:ball.q[1]"]
    found = trunnion.sweep("spherical_pendulum", cases=CASES, reductions=kept, cpu_limit=0.2, every=1e-3, kernel=kernel)
    others = trunnion.sweep("spherical_pendulum", cases=CASES[::2], reductions=["final:ball.q[1]"], every=1e-3, kernel=kernel)
    assert found.counts == {"done": 2, "out_of_time": 1}
    rows = [{k: v for k, v in r.items() if k != "case"} for r in found.table.to_pylist()]
    assert rows[::2] == [{k: v for k, v in r.items() if k != "case"} for r in others.table.to_pylist()]
    assert 0.0 < rows[1]["outcome.time"] < NEVER
    assert "cpu_limit" in rows[1]["outcome.advice"]


def test_the_time_limit_applies_to_each_case_alone() -> None:
    scene = trunnion.load_scene("spherical_pendulum")
    cases = listed(scene, [{MU: 0.2 + 1e-4 * i, END: 0.1} for i in range(400)])
    run = Run(cpu_limit=0.1)
    one = Runner(plan(scene, None, [cases.changes(0)], keep=["final:ball.q[1]"], run=run))
    one.chunk(0, 1)
    table = Runner(plan(scene, None, [cases.changes(i) for i in range(400)], keep=["final:ball.q[1]"], run=run)).chunk(0, 400)
    assert set(table["outcome"].to_pylist()) == {"done"}


def test_a_budget_of_steps_ends_a_case_where_that_of_a_single_run_does() -> None:
    found = trunnion.sweep("spherical_pendulum", {MU: [0.2, 0.4]}, reductions=["final:ball.q[1]"], until=50.0, max_steps="40")
    alone = trunnion.simulate("spherical_pendulum", 50.0, overrides={MU: 0.4}, max_steps=40, kernel="parts")
    row = found.table.to_pylist()[1]
    assert (row["outcome"], row["steps"], row["outcome.time"]) == ("max_steps", 40, alone.outcome.time)
    assert found.trajectory(1).outcome == alone.outcome
