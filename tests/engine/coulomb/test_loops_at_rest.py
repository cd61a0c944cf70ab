"""Closed loops that friction holds in every joint. Plane statics with friction cones gives the load that releases a loop, although
the friction of the loop is not unique."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.engine.mechanisms.ball_pendulum_and_arm import run
from tests.engine.mechanisms.planar_friction_loops import FIVE_BAR, FOUR_BAR, PlaneLoop
from tests.reference.contact_and_friction.sprung_toggle_press import CIRCLE, LINK
from tests.reference.scenes.random_scenes import random_loop
from tests.stability.entries.toggle_press import placed
from tests.stability.scene_verdicts import holding
from trunnion.analysis.static_bounds.start_pose_statics import hold
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import simulate

LOOPS = {"four-bar": FOUR_BAR, "five-bar": FIVE_BAR}
EXACT = 1e-9
WHICH = ["four-bar", "five-bar"]


@cache
def most(which: str, sense: float) -> float:
    return LOOPS[which].most(sense)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize("which", WHICH)
def test_a_sticking_loop_holds_up_to_the_most_that_any_distribution_of_friction_can(which: str, sense: float) -> None:
    loop: PlaneLoop = LOOPS[which]
    for share, holds in ((0.5, True), (1 - EXACT, True), (1 + EXACT, False), (1.2, False)):
        report = hold(loop.scene(sense * share * most(which, sense)))
        assert report.holds is holds, (share, report.margin)
        assert not any(p.unique for p in report.pairs)


@pytest.mark.parametrize("which", WHICH)
def test_a_sticking_loop_slips_when_a_growing_torque_reaches_the_largest_it_holds(which: str) -> None:
    ramp = sm.Signal(table=sm.Table((0.0, 10.0), (0.0, 2.0 * most(which, 1.0))))
    r = run(LOOPS[which].scene(ramp), 5.01, 0.5, rtol=1e-8, outputs=("*.q[1]", "*.qd[1]"))
    assert r.events[0].kind == "slip"
    assert r.events[0].time == pytest.approx(5.0, rel=EXACT)
    still = r.time < 5.0
    for i in range(LOOPS[which].count):
        assert np.all(r[f"p{i}.qd[1]"][still] == 0.0)
        assert np.ptp(r[f"p{i}.q[1]"][still]) <= 1e-14  # the angle of the cut joint is computed from the bodies, with round-off
    assert any(("not" in n and "unique" in n) or "not (smallest" in n for n in r.notes)


def test_a_sticking_loop_stays_for_ever() -> None:
    r = run(FOUR_BAR.scene(0.9 * most("four-bar", 1.0)), 1000.0, 100.0)
    assert not r.events
    assert max(np.ptp(r[f"p{i}.q[1]"]) for i in range(4)) <= np.radians(1e-12)


ARM, SHARE = 1e-6, 0.9
"""Mass of an arm, kg, that loads no joint of a loop by more than 1e-5 of its load, and the share of its pin's capacity that the arm
needs."""


@pytest.mark.parametrize("extra", [0.3, 0.8])
def test_load_sharing_in_a_loop_does_not_depend_on_a_resting_pair_beside_the_loop(extra: float) -> None:
    """A light arm on the coupler is at rest with a share of its capacity that differs from the share of the loop's joints."""
    alone = FOUR_BAR.scene(extra * most("four-bar", 1.0))
    d, reach = FOUR_BAR.link(1), FOUR_BAR.reach()[0]
    arm = sm.Body(mass=ARM, inertia=(ARM, ARM, ARM), center=(SHARE * reach, 0.0, 0.0))
    pin = replace(alone.joints["p0"], inboard="l1", outboard="arm", start=sm.Start(float(np.arctan2(d[1], d[0])), 0.0))
    beside = replace(alone, bodies={**alone.bodies, "arm": arm}, joints={**alone.joints, "arm": pin})
    shares = {p.joint: p.share for p in hold(beside).pairs}
    assert shares.pop("arm") == pytest.approx(SHARE, rel=1e-9)
    assert shares == pytest.approx({p.joint: p.share for p in hold(alone).pairs}, rel=1e-4)


LOCKS = brentq(lambda h: h * math.sqrt(1 - CIRCLE**2 / (LINK**2 - h**2)) - CIRCLE, 0.1 * CIRCLE, 2 * CIRCLE, rtol=1e-14)
"""Height (m) of a press's knee above its foot, links folded on each other. Up to this height a load on its foot cannot fold or open
the press. The links carry the load along one line through the friction circles of all three pins; the line between those of crown
and foot touches the knee's circle. There is no weight."""
NEARLY = 1e-4
"""A group is released where every distribution of its load exceeds the capacity by at least a ten-thousandth."""


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("load", [100.0, -100.0])
@pytest.mark.parametrize("part", [0.2, 0.5, 0.9, 1 - NEARLY, 1 + NEARLY, 1.2])
def test_a_folded_press_locks_itself_in_statics_and_in_runs(load: float, part: float) -> None:
    scene = replace(placed(-math.acos(part * LOCKS / LINK), 0.0, 0.0, load, 0.01), gravity=(0.0, 0.0, 0.0))
    assert holding(scene) == ("holds" if part < 1 else "slips")
    if part < 1:
        # the least share of friction occurs when the line of force runs between the two friction circles
        assert 0 < hold(scene).margin <= 1 - part + EXACT


def test_numbers_of_a_trial_step_that_are_not_finite_end_no_process() -> None:
    """Pairs at rest whose responses are NaN must not form a group of rank zero."""
    scene = random_loop("diag17f14", laws=("coulomb", "stribeck", "regularized", "lugre", "viscous")).scene
    assert simulate(scene, until=3.0, rtol=1e-6, method="rk8").outcome.ok
