"""Results of a run: columns by name, units, counts, and outcomes with partial rows. A repeated run gives the same bits."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.paper_friction_law import PAPER
from trunnion.basics.errors import SceneError
from trunnion.scene import Scene, load_scene
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation import run as running
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import Model, simulate
from trunnion.simulation.runtime_interface import simulation_block as bl


@cache
def pendulum() -> Result:
    """A run of example 8.1 with rows every 0.3 s. Its end is not a multiple of this interval, so that the last interval is
    shorter."""
    return simulate("spherical_pendulum", until=1.0, every=0.3, overrides=PAPER)


def out_of_reach() -> Scene:
    """Example 8.2 without friction and with a rod of 0.3 m. The loop closes at the start, and the run ends at sin φ = 0.6."""
    scene = load_scene("crank_slider")
    bodies = scene.bodies | {"rod": replace(scene.bodies["rod"], center=(0.15, 0.0, 0.0), points={"end": (0.3, 0.0, 0.0)})}
    joints = {n: replace(j, friction=None, start=sm.Start(q=0.8) if n == "guide" else None) for n, j in scene.joints.items()}
    return replace(scene, bodies=bodies, joints=joints)


def test_a_row_at_the_end_of_a_step_does_not_depend_on_the_rows_inside_it() -> None:
    """Newton's iteration for the friction of this row begins with the value at the end of the step. It does not begin with the
    result of the previous row."""
    asked = {"method": "rk8", "step": 0.01, "outputs": "ball.*"}
    whole, quarters = (simulate("spherical_pendulum", 1.0, every, **asked) for every in (0.01, 0.0025))
    assert np.array_equal(whole.time, quarters.time[::4])
    assert np.array_equal(whole.data, quarters.data[::4])


# -- columns ------------------------------------------------------------------------------------------------------------------


def test_columns_are_found_by_name_with_their_units() -> None:
    r = pendulum()
    assert r.names[0] == "time"
    assert r["time"] is not r.data
    assert np.array_equal(r["time"], r.time)
    assert np.array_equal(r["ball.qd[2]"], r.data[:, r.names.index("ball.qd[2]")])
    assert "ball.qd[2]" in r
    assert "ball.qd[4]" not in r
    units = {
        "s": "time", "1": "ball.q[1]", "rad/s": "ball.qd[1]", "rad/s^2": "ball.qdd[1]", "m": "pendulum.position[1]",
        "N": "ball.reaction.force[1]", "N*m": "ball.reaction.torque[1]", "rad": "ball.contact[1].angle", "J": "ball.friction.work",
    }  # fmt: skip
    assert {u: r.units[n] for u, n in units.items()} == {u: u for u in units}
    assert set(r.units) == set(r.names)
    assert all(c.description for c in r.columns)


def test_units_of_travels_and_turns_differ() -> None:
    r = simulate("double_pendulum", until=1e-3, every=1e-3, overrides=PAPER)
    expected = {
        "guide.q[1]": "m",
        "guide.q[2]": "rad",
        "guide.qd[1]": "m/s",
        "guide.friction.force": "N",
        "guide.friction.torque[1]": "N*m",
    }
    assert {n: r.units[n] for n in expected} == expected


def test_a_name_that_is_not_there_brings_the_nearest_ones() -> None:
    with pytest.raises(KeyError, match=r"no column 'ball.friction.torqe\[2\]'; did you mean .*ball.friction.torque\[2\]"):
        pendulum()["ball.friction.torqe[2]"]


def test_patterns_pick_columns_and_brackets_are_just_brackets() -> None:
    r = pendulum()
    assert r.matching("ball.q[*]") == [f"ball.q[{i}]" for i in (1, 2, 3, 4)]
    assert r.matching("*.friction.torque[2]") == ["ball.friction.torque[2]"]
    assert r.matching("nothing*") == []
    chosen = simulate("spherical_pendulum", until=1.0, every=0.3, outputs=["ball.q[1]", "energy.*"], overrides=PAPER)
    assert chosen.names == ["time", "ball.q[1]", *r.matching("energy.*")]


def test_the_columns_asked_for_do_not_change_the_motion() -> None:
    """Requested works are integrated under error control, which may shorten steps. The motion then differs by the tolerance."""
    columns = (["ball.qd[2]"], ["*.q*", "*.contact*", "*.reaction*"])
    one, most = (simulate("spherical_pendulum", until=1.0, every=0.3, outputs=o, overrides=PAPER) for o in columns)
    assert one["ball.qd[2]"] == pytest.approx(most["ball.qd[2]"], abs=1e-13)
    assert one.stats.steps == most.stats.steps
    # the limit is ten times rtol times the largest rate
    assert one["ball.qd[2]"] == pytest.approx(pendulum()["ball.qd[2]"], abs=10 * 1e-6 * 5.0)


def test_a_pattern_that_matches_nothing_is_a_mistake() -> None:
    with pytest.raises(SceneError) as caught:
        simulate("spherical_pendulum", until=1.0, outputs=["ball.friction.torqe*", "nothing", "energy.*"], overrides=PAPER)
    assert len(caught.value.problems) == 2
    assert "friction.torque" in caught.value.problems[0].hint


# -- rows and counts ----------------------------------------------------------------------------------------------------------


def test_rows_lie_on_the_grid_and_the_last_at_the_end() -> None:
    assert pendulum().time == pytest.approx([0.0, 0.3, 0.6, 0.9, 1.0], abs=1e-15)
    assert len(pendulum()) == 5
    r = simulate("simple_pendulum", until=1.0, every=0.1)
    assert r.time == pytest.approx(np.arange(11) / 10, abs=1e-15)  # if the end is on the grid, it has one row
    every_step = simulate("simple_pendulum", until=1.0, every=0.0)
    assert len(every_step) == every_step.stats.steps + 1
    assert np.all(np.diff(every_step.time) > 0)
    assert every_step.time[-1] == 1.0


def test_a_run_without_a_spacing_has_a_thousand_rows() -> None:
    scene = load_scene("simple_pendulum")
    r = simulate(replace(scene, simulation=replace(scene.simulation, every=None)), until=2.0)
    assert len(r) == 1001


def test_counts_are_those_of_the_method() -> None:
    """A step of order 8 takes twelve evaluations. The dense output takes three more in steps with rows, and one more for each
    row."""
    r = simulate("simple_pendulum", until=5.0, every=5.0, method="rk8")
    s = r.stats
    assert s.counters["rk8"] == s.steps > 10
    assert s.events == s.jacobians == 0
    assert 12 * (s.steps + s.rejected) <= s.rhs_evaluations <= 12 * (s.steps + s.rejected) + 10
    assert s.wall_time >= 0.0
    assert s.build_time >= 0.0
    assert s.setup_time >= 0.0
    stiff = simulate("simple_pendulum", until=5.0, every=5.0, method="rosenbrock").stats
    assert stiff.counters["rosenbrock"] == stiff.steps <= stiff.jacobians <= stiff.steps + stiff.rejected + 1


def test_the_result_says_how_it_was_run() -> None:
    r = simulate("simple_pendulum", until=0.5, every=0.25, rtol=1e-8, method="rk5", step=0.01)
    how = {"until": 0.5, "every": 0.25, "rtol": 1e-8, "method": "rk5", "step": 0.01, "kernel": "parts"}
    assert r.settings == how
    assert r.scene.name == "simple_pendulum"
    assert str(r.outcome) == "done at t = 0.5 s"
    assert repr(r) == f"<Result of simple_pendulum: 3 rows × {len(r.names)} columns, done at t = 0.5 s>"
    changed = simulate("simple_pendulum", until=0.1, overrides={"bodies.bob.mass": 3.0})
    assert changed.scene.bodies["bob"].mass == 3.0


# -- repeated runs ------------------------------------------------------------------------------------------------------------


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("name", ["spherical_pendulum", "crank_slider", "double_pendulum", "governor", "bricard"])
def test_the_same_run_twice_is_the_same_bits(name: str) -> None:
    one, two = (simulate(name, until=0.5, every=0.01) for _ in range(2))
    assert np.array_equal(one.data, two.data, equal_nan=True)
    assert one.events == two.events
    assert one.stats.counters == two.stats.counters


@pytest.mark.parametrize("name", ["spherical_pendulum", "crank_slider", "governor"])
def test_a_model_can_be_run_again_and_is_the_same_bits(name: str) -> None:
    model = Model(load_scene(name), ("*",))
    one, _, two = (running.run(model, until, 0.01, bl.Settings()) for until in (0.5, 0.123, 0.5))
    assert np.array_equal(one.data, two.data, equal_nan=True)
    assert one.events == two.events


def test_a_second_run_of_a_model_counts_turns_from_its_own_start() -> None:
    model = Model(load_scene("n_four_bar"), ("right*.q*",))
    one, two = (running.run(model, 4.0, 0.05, bl.Settings()) for _ in range(2))
    assert np.ptp(one["right2.q[1]"]) > np.pi
    assert np.array_equal(one.data, two.data)


# -- runs that end early ------------------------------------------------------------------------------------------------------


def test_a_step_budget_ends_a_run_and_keeps_its_rows() -> None:
    whole = simulate("simple_pendulum", until=5.0, every=0.05)
    part = simulate("simple_pendulum", until=5.0, every=0.05, max_steps=25)
    assert (part.outcome.name, part.outcome.ok, part.stats.steps) == ("max_steps", False, 25)
    assert 0.0 < part.time[-1] <= part.outcome.time < 5.0
    assert np.array_equal(part.data, whole.data[: len(part)])


def test_a_run_to_the_end_of_reach_keeps_its_rows() -> None:
    r = simulate(out_of_reach(), until=1.0, every=0.001)
    assert not r.outcome.ok
    assert r.outcome.name == "open_loop"
    assert r.outcome.time == pytest.approx(np.arcsin(0.6) / 10, abs=1e-4)
    assert r.outcome.time - 0.002 < r.time[-1] <= r.outcome.time
    assert np.isfinite(r.data).all()
    x = 0.5 * np.cos(10 * r.time) + np.sqrt(0.09 - 0.25 * np.sin(10 * r.time) ** 2)
    assert r["slider.position[1]"] == pytest.approx(x, abs=1e-9)


def test_the_end_of_reach_is_the_outcome_of_the_run() -> None:
    assert simulate(out_of_reach(), until=1.0).outcome.name in ("open_loop", "step_underflow")


def test_numbers_out_of_range_are_named() -> None:
    """A large force acts on tiny masses, so that the acceleration overflows."""
    joints = {"arm": sm.Joint("revolute", "ground", "a", axis="y"), "push": sm.Joint("prismatic", "a", "b", axis="x", effort=1e300)}
    bodies = {"a": sm.Body(box=(1.0, 0.1, 0.1), mass=1e-290), "b": sm.Body(mass=1e-290, inertia=(1e-290, 1e-290, 1e-290))}
    r = simulate(sm.Scene(bodies, joints), until=1.0)
    assert (r.outcome.name, r.outcome.time, len(r)) == ("not_finite", 0.0, 0)
    assert r.outcome.joint in ("arm", "push")


def test_a_freedom_without_inertia_is_named() -> None:
    """A torque acts on a body without inertia about the axis of its joint."""
    joints = {"spin": sm.Joint("revolute", "ground", "b", axis="y", effort=1.0)}
    r = simulate(sm.Scene({"b": sm.Body(mass=1.0, inertia=(0.0, 0.0, 0.0))}, joints), until=1.0)
    assert (r.outcome.name, r.outcome.time, r.outcome.joint) == ("no_inertia", 0.0, "spin")


def test_an_interrupt_in_the_progress_callback_keeps_the_rows_so_far(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter(float(t) for t in range(100000))
    monkeypatch.setattr("time.perf_counter", lambda: next(clock))
    told: list[tuple[float, float]] = []

    def progress(time: float, until: float) -> None:
        told.append((time, until))
        if len(told) == 3:
            raise KeyboardInterrupt

    r = simulate("crank_slider", until=1000.0, every=1.0, outputs=["slider.*"], progress=progress, overrides=PAPER)
    assert (r.outcome.name, r.outcome.ok) == ("cancelled", False)
    assert [u for _, u in told] == [1000.0] * 3
    assert 0.0 < told[0][0] < told[1][0] < told[2][0] == r.outcome.time < 1000.0
    assert len(r) == int(r.outcome.time) + 1
    assert "results up to this time are kept" in r.outcome.advice


def test_rows_that_need_no_forces_cost_no_evaluations() -> None:
    """Coordinates come from the dense output. Only columns that depend on multipliers or accelerations need a solution."""
    few, many = (simulate("friction_identification", until=2.0, every=every, outputs="*.q[1]") for every in (2.0, 1e-3))
    assert len(many) > 1000 > len(few)
    assert many.stats.rhs_evaluations <= few.stats.rhs_evaluations + 3 * many.stats.steps


def test_rows_of_forces_leave_the_motion_as_it_is() -> None:
    """The motion is bit-identical. Columns of works change the motion, because the works are integrated and their errors count."""
    wanted = (["*.q[1]"], ["*.q[1]", "*.friction.torque*", "*.qdd[1]"])
    alone, among = (simulate("friction_identification", until=2.0, every=0.01, outputs=o) for o in wanted)
    name = next(n for n in alone.names if n.endswith(".q[1]"))
    assert np.array_equal(alone[name], among[name])
    assert [e.time for e in alone.events] == [e.time for e in among.events]
