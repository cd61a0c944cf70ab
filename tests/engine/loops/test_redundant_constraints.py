"""Loops with redundant constraints. Reported reactions are the smallest in the metric of the bodies' masses; with friction they are
the limit of stiff contacts. Reactions do not depend on the description of the mechanism or on the cut."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.engine.checks.reference_comparison import engine_row, engine_table, results, worst
from tests.engine.mechanisms.redundant_loops import case_of, four_bar, open_reactions, smallest
from tests.reference.contact_and_friction.joint_friction import Rubbing, pin_of, reaction
from tests.reference.contact_and_friction.stiff_spring_contacts import Compliant
from tests.reference.scenes.frame_changes import reframed, rotated, shuffled
from tests.reference.scenes.joint_side_swap import swap_joint_sides
from tests.reference.scenes.result_table import Moved
from tests.reference.scenes.unit_changes import rescaled
from trunnion.simulation.run import simulate
from trunnion.system.construction.spanning_tree import span

TOLERANCE = 1e-10
"""Required agreement. Round-off times condition is 1e-13 here; reactions in another metric differ by tens of percent."""
WAYS = {
    "order": lambda case: shuffled(case, 3),
    "world axes": lambda case: rotated(case, 4),
    "body frames": lambda case: reframed(case, 5),
    "units": lambda case: rescaled(case, 1000.0, 1e-3, 2.0),
}


@pytest.mark.parametrize("which", ["bricard", "loops"])
def test_reactions_reported_are_the_smallest_that_carry_the_motion(which: str) -> None:
    case = case_of(which)
    mine = results(*engine_row(case))
    eq, wrench, loose = open_reactions(case)
    assert len(eq.rows) - eq.rank == {"bricard": 1, "loops": 12}[which]
    amounts = smallest(case, eq, wrench, loose)
    assert np.abs(amounts).max() > 1e-2  # the reference finds other reactions, so the reactions are not unique
    for name in case.scene.joints:
        chosen = -(wrench[name] + loose[name] @ amounts)
        force, torque = reaction(eq.state, name, chosen)
        assert np.abs(mine[name, "reaction.force"] - force).max() <= TOLERANCE * 30.0  # tolerance in N
        assert np.abs(mine[name, "reaction.torque"] - torque).max() <= TOLERANCE * 10.0  # tolerance in N m
        assert mine[name, "qdd"] == pytest.approx(eq.accelerations(name) @ [1.0], rel=TOLERANCE)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("which", ["regularized", "viscous"])
def test_where_a_joint_rubs_reactions_are_the_limit_of_stiff_contacts(which: str) -> None:
    case = case_of(which)
    mine = results(*engine_row(case))
    eta = mine["c", "friction"]
    eq, wrench, loose = open_reactions(case, eta)
    assert len(eq.rows) - eq.rank == 3
    model = Compliant(eq.state)
    acceleration, _ = model.solve()
    assert model.residual <= TOLERANCE
    assert mine["c", "normal_force"] == pytest.approx(model.normal_force["c"][:2], rel=TOLERANCE)
    assert mine["crank", "acceleration"] == pytest.approx(acceleration[6 * eq.index["crank"] :][:3], rel=TOLERANCE)
    amounts = [np.linalg.lstsq(loose[n], _reported(eq, mine, n) - wrench[n], rcond=None)[0] for n in case.scene.joints]
    # these reactions differ from the reactions of least norm, so reactions are not unique
    assert max(np.abs(a).max() for a in amounts) > 1e-2
    law, contacts = Rubbing(eq.state, "c").friction(-_reported(eq, mine, "c"), np.zeros(1))
    assert mine["c", "friction"] == pytest.approx(law, rel=TOLERANCE)  # the engine's root obeys the law
    assert mine["c", "normal_force"] == pytest.approx([c.normal_force for c in contacts], rel=TOLERANCE)


def _reported(eq, mine, name: str) -> np.ndarray:
    """The engine's wrench on a joint's outboard part at the outboard point, in world axes."""
    pose = eq.state.joint_pose(name)
    force = -pose.A_in @ mine[name, "reaction.force"]
    torque = -pose.A_in @ mine[name, "reaction.torque"]
    return np.r_[force, torque - np.cross(pose.p_out - pin_of(eq.state, name).point, force)]


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("which", ["bricard", "loops", "regularized"])
def test_open_reactions_do_not_depend_on(which: str, way: str) -> None:
    case = case_of(which)
    moved = WAYS[way](case)
    gap, where = worst(engine_table(case), moved.back(engine_table(moved.case)))
    assert gap <= TOLERANCE, where


@pytest.mark.default_cases(2)
@pytest.mark.parametrize(("which", "name"), [("bricard", "j5"), ("bricard", "j2"), ("regularized", "c"), ("regularized", "a")])
def test_open_reactions_do_not_depend_on_the_side_a_joint_is_described_from(which: str, name: str) -> None:
    case = case_of(which)
    moved = swap_joint_sides(case, name)
    gap, where = worst(engine_table(case), moved.back(engine_table(moved.case)))
    assert gap <= TOLERANCE, where


@pytest.mark.default_cases(2)
@pytest.mark.parametrize(("which", "name"), [("bricard", "j1"), ("bricard", "j3"), *(("viscous", n) for n in "abcd")])
def test_open_reactions_do_not_depend_on_where_the_loop_is_cut(which: str, name: str) -> None:
    case = case_of(which)
    joints = {n: replace(j, cut=n == name) for n, j in case.scene.joints.items()}
    moved = Moved(replace(case, scene=replace(case.scene, joints=joints)), lambda t: t)
    assert span(moved.case.scene).cut == (name,)
    gap, where = worst(engine_table(case), engine_table(moved.case))
    assert gap <= TOLERANCE, where


@pytest.mark.parametrize(("which", "count"), [("bricard", 1), ("loops", 12), ("regularized", 3)])
def test_the_result_names_reactions_that_are_not_unique(which: str, count: int) -> None:
    case = case_of(which)
    result = simulate(case.scene, until=1e-3)
    _, _, loose = open_reactions(case)
    named = {n for n, w in loose.items() if np.abs(w).max() > 1e-6}
    assert result.redundancy.count == count
    assert set(result.redundancy.joints) == named
    assert any("redundant" in note and all(n in note for n in named) for note in result.notes)


def test_a_loop_without_redundancy_has_no_note() -> None:
    result = simulate("spatial_slider_crank", until=1e-3)
    assert result.redundancy.count == 0
    assert result.notes == ()


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("method", ["rk5", "rk8", "rosenbrock"])
@pytest.mark.parametrize("rtol", [1e-3, 3e-4, 1e-4, 1e-5])
def test_a_pin_that_reverses_at_its_dead_centre_does_not_stop_the_mechanism(method: str, rtol: float) -> None:
    """The four-bar's pin with friction has zero speed for an instant while the bars move fast. The remaining speed is the error of
    the loop. An impulse of the pin's friction must not remove this speed."""
    exact = simulate(four_bar("coulomb"), until=1.0, every=0.1, rtol=1e-11, outputs=["a.qd*"])["a.qd[1]"]
    r = simulate(four_bar("coulomb"), until=1.0, every=0.1, rtol=rtol, method=method, outputs=["a.qd*"])
    assert [(e.kind, e.joint) for e in r.events] == [("reversal", "c")] * 4
    assert np.abs(r["a.qd[1]"] - exact).max() <= 1000 * rtol
