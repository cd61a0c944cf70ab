"""A case of a batch equals a single run by ``trunnion.simulate``: every number, to the last bit."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from tests.engine.mechanisms.redundant_loops import four_bar
from trunnion.batch.plan_and_runner import Plan, Run, Runner, plan
from trunnion.batch.sweep import trajectory
from trunnion.scene import load_scene
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.overrides import apply

MU, ANGLE = "joints.ball.friction.mu", "joints.ball.start.q.angle"
TURNED = {"joints.ball.start.q": {"axis": [0, 1, 0], "angle": 0.0}}


@cache
def scene(name: str) -> Scene:
    """The pendulum with a start angle (in bounded steps), a redundant four-bar, or a bundled model."""
    if name == "four_bar":
        return four_bar()
    if name == "bounded":
        return apply(load_scene("spherical_pendulum"), TURNED | {"simulation.realtime": {"step": 1e-3}})
    return apply(load_scene(name), TURNED) if name == "spherical_pendulum" else load_scene(name)


CASES: dict[str, tuple[str, dict[str, Any], list[str], Run]] = {
    "open tree": (
        "spherical_pendulum",
        {MU: "0:0.7:4", ANGLE: "-30 deg:30 deg:3"},
        ["ball.contact[1].normal_force", "ball.qd[2]"],
        Run(3.0),
    ),
    "only the solver's steps": ("spherical_pendulum", {MU: [0.2, 0.6]}, ["ball.friction.torque[2]"], Run(2.0, 0.0)),
    "an end between rows": ("spherical_pendulum", {MU: [0.2, 0.6]}, ["pendulum.position[1]"], Run(1.0, 0.3, 1e-8)),
    "stiff method": ("spherical_pendulum", {MU: [0.3, 0.6]}, ["ball.q[1]", "energy.residual"], Run(1.0, None, None, "rosenbrock")),
    "closed loop": (
        "crank_slider",
        {"joints.slider_pin.friction.mu": "0.1:0.4:3"},
        ["slider_pin.contact[*].normal_force"],
        Run(0.5),
    ),
    "mass and size": (
        "spherical_pendulum",
        {"bodies.pendulum.density": [7000, 8000], "bodies.pendulum.box[2]": [0.1, 0.2]},
        ["ball.qdd[2]"],
        Run(1.0),
    ),
    "gravity and start rate": ("double_pendulum", {"gravity[3]": [-9.0, -3.0]}, ["*.q[1]"], Run(0.3)),
    "reactions that redundant loops leave open": (
        "four_bar",
        {"joints.c.friction.mu": [0.1, 0.4]},
        ["c.contact[*].normal_force"],
        Run(0.1),
    ),
    "a jam": ("double_pendulum", {"joints.guide.friction.half_length": [0.1, 0.15, 0.3]}, ["*.q[1]"], Run(0.2)),
    "bounded steps": (
        "bounded",
        {MU: [0.2, 0.6], "simulation.realtime.step": [1e-3, 2e-3]},
        ["ball.qd[2]", "realtime.overruns"],
        Run(1.0, 0.02),
    ),
    "settings of the scene": (
        "spherical_pendulum",
        {"simulation.until": [0.5, 1.0], "simulation.rtol": [1e-4, 1e-8]},
        ["ball.qd[2]"],
        Run(),
    ),
}


def made(name: str) -> Plan:
    model, over, columns, run = CASES[name]
    keep = [f"{kind}:{c}" for c in columns for kind in ("max", "min", "final", "mean")]
    return plan(scene(model), over, keep=[*keep, "count:any", "first:any", "first:reversal"], run=run)


def expected(p: Plan, case: int) -> dict[str, Any]:
    """The row of numbers that a single run of the case gives."""
    columns = list(dict.fromkeys(r.what for r in p.reductions if r.kind in ("max", "min", "final", "mean")))
    r = trajectory(p, case, columns)
    times = [e.time for e in r.events]
    reversals = [e.time for e in r.events if e.kind == "reversal"]
    row: dict[str, Any] = {
        "case": case,
        "outcome": r.outcome.name,
        "outcome.time": r.outcome.time,
        "outcome.joint": r.outcome.joint,
    }
    row |= {"outcome.advice": r.outcome.advice, "steps": r.stats.steps, "count:any": float(len(times))}
    a = r.audit
    row |= {"audit": a.verdict, "audit.energy": None if a.energy is None else a.share, "audit.note": "; ".join(a.notes)}
    row |= {"first:any": min(times, default=None), "first:reversal": min(reversals, default=None)}
    for c in columns:
        values = r[c][np.isfinite(r[c])]
        empty = not len(values)
        row |= {f"max:{c}": None if empty else values.max(), f"min:{c}": None if empty else values.min()}
        row |= {f"mean:{c}": None if empty else np.cumsum(values)[-1] / len(values)}
        row |= {f"final:{c}": r[c][-1] if len(r) and np.isfinite(r[c][-1]) else None}
    return row | p.cases.changes(case)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("name", CASES)
def test_every_number_of_a_case_is_that_of_a_single_run(name: str) -> None:
    p = made(name)
    for row in Runner(p).chunk(0, p.cases.count).to_pylist():
        assert row == expected(p, row["case"])


def test_bounded_steps_differ_and_rows_between_them_are_refused_case_by_case() -> None:
    """Cases with other bounded steps give other results. If all cases ignored their settings, the tests above would still pass."""
    free = plan(scene("spherical_pendulum"), {MU: [0.2]}, keep=["final:ball.qd[2]"], run=Run(1.0, 0.02, 1e-4))
    steps = [r["steps"] for r in Runner(made("bounded steps")).chunk(0, 4).to_pylist()]
    assert min(steps[::2]) >= 1000  # an event divides one of the steps
    assert 1000 > min(steps[1::2]) >= 500 > Runner(free).chunk(0, 1).to_pylist()[0]["steps"]
    spacings = [0.02 * k for k in range(1, 51)] + [0.0205]
    p = plan(scene("bounded"), {"simulation.every": spacings}, keep=["final:ball.qd[2]"], run=Run(0.1))
    rows = Runner(p).chunk(0, 51).to_pylist()
    assert [r["outcome"] for r in rows] == 50 * ["done"] + ["invalid"]
    assert "not a multiple of the step, 0.001 s" in rows[-1]["outcome.advice"]


def test_a_run_that_jams_is_a_row_with_its_diagnosis_beside_good_ones() -> None:
    p = made("a jam")
    rows = Runner(p).chunk(0, 3).to_pylist()
    assert [r["outcome"] for r in rows] == ["jammed", "jammed", "done"]
    assert rows[0]["outcome.joint"] == "guide"
    assert "half_length" in rows[0]["outcome.advice"]


def test_how_a_batch_is_cut_changes_nothing() -> None:
    p = made("open tree")
    whole = Runner(p).chunk(0, p.cases.count)
    pieces, one = Runner(p), Runner(p)
    parts = [pieces.chunk(i, min(i + 5, p.cases.count)) for i in range(0, p.cases.count, 5)]
    assert whole.to_pylist() == [row for t in parts for row in t.to_pylist()]
    backwards = [one.chunk(i, i + 1).to_pylist()[0] for i in reversed(range(p.cases.count))]
    assert whole.to_pylist() == backwards[::-1]


def test_values_copied_in_bulk_are_those_built_one_by_one() -> None:
    ranges = {MU: (0.1, 0.6), "gravity[3]": (-12, -3), "joints.ball.friction.radius": (0.01, 0.05)}
    p = plan(scene("spherical_pendulum"), sample=ranges, count=400, seed=3, keep=["final:ball.qd[2]"], run=Run(0.02))
    bulk = Runner(p).chunk(0, 400).to_pylist()
    single = Runner(p)
    for i in range(0, 400, 29):
        assert single.chunk(i, i + 1).to_pylist()[0] == bulk[i]


def test_a_number_that_the_scene_refuses_is_a_case_with_this_outcome() -> None:
    p = plan(scene("spherical_pendulum"), {MU: [0.3, -1.0, 0.5]}, keep=["final:ball.qd[2]"], run=Run(0.1))
    rows = Runner(p).chunk(0, 3).to_pylist()
    assert [r["outcome"] for r in rows] == ["done", "invalid", "done"]
    assert MU in rows[1]["outcome.advice"]
    assert rows[1]["final:ball.qd[2]"] is None


def test_numbers_written_as_zero_change_the_structure_and_still_give_the_same_as_a_single_run() -> None:
    p = plan(scene("spherical_pendulum"), {"gravity[1]": [0.0, 1.0]}, keep=["final:ball.qd[2]"], run=Run(0.2))
    assert [r["final:ball.qd[2]"] for r in Runner(p).chunk(0, 2).to_pylist()] == [
        expected(p, i)["final:ball.qd[2]"] for i in (0, 1)
    ]


def test_a_runner_that_uses_the_kernel_of_another_gives_the_same_rows() -> None:
    """The plans differ only in their cases: other numbers, other paths, and a number that changes the structure."""
    settings: dict[str, Any] = {"keep": ["final:ball.q[*]"], "run": Run(until=0.1)}
    first = Runner(plan(scene("spherical_pendulum"), {MU: [0.1, 0.2]}, **settings))
    first.chunk(0, 2)
    for vary in ({MU: [0.2, 0.0, 0.3]}, {ANGLE: [0.4, 0.5]}):
        there = plan(scene("spherical_pendulum"), vary, **settings)
        assert there.is_like(first.plan)
        assert plan(scene("spherical_pendulum"), vary, **settings, earlier=first.plan) == there
        later = Runner(there, earlier=first)
        assert later.chunk(0, there.cases.count).equals(Runner(there).chunk(0, there.cases.count))
        assert later.loops[0] is first.loops[0]
    for changes, change in (({"simulation.rtol": 1e-4}, {}), ({}, {"keep": ["max:ball.q[*]"]}), ({}, {"run": Run(until=0.2)})):
        other = apply(scene("spherical_pendulum"), changes)
        assert not plan(other, {MU: [0.1, 0.2]}, **settings | change).is_like(first.plan)
