"""Closed loops held by friction in every joint: released exactly where plane statics with friction cones says; friction not
unique."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from engine.scene import model as sm
from engine.simulation.hold import hold
from tests.engine.dry import run
from tests.engine.plane_loops import FIVE_BAR, FOUR_BAR, PlaneLoop

LOOPS = {"four-bar": FOUR_BAR, "five-bar": FIVE_BAR}
EXACT = 1e-9
WHICH = ["four-bar", "five-bar"]


@cache
def most(which: str, sense: float) -> float:
    return LOOPS[which].most(sense)


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize("which", WHICH)
def test_a_sticking_loop_holds_up_to_the_most_that_any_distribution_of_friction_can(which: str, sense: float) -> None:
    loop: PlaneLoop = LOOPS[which]
    for share, holds in ((0.5, True), (1 - EXACT, True), (1 + EXACT, False), (1.2, False)):
        report = hold(loop.scene(sense * share * most(which, sense)))
        assert report.holds is holds, (share, report.margin)
        assert not any(p.unique for p in report.pairs)


@pytest.mark.parametrize("which", WHICH)
def test_a_sticking_loop_is_let_go_when_a_growing_torque_reaches_that(which: str) -> None:
    ramp = sm.Signal(table=sm.Table((0.0, 10.0), (0.0, 2.0 * most(which, 1.0))))
    r = run(LOOPS[which].scene(ramp), 5.01, 0.5, rtol=1e-8, outputs=("*.q[1]", "*.qd[1]"))
    assert r.events[0].kind == "slip"
    assert r.events[0].time == pytest.approx(5.0, rel=EXACT)
    still = r.time < 5.0
    for i in range(LOOPS[which].count):
        assert np.all(r[f"p{i}.qd[1]"][still] == 0.0)
        assert np.ptp(r[f"p{i}.q[1]"][still]) <= 1e-14  # the cut joint's angle is measured
    assert any(("not" in n and "unique" in n) or "not (smallest" in n for n in r.notes)


def test_a_sticking_loop_stays_for_ever() -> None:
    r = run(FOUR_BAR.scene(0.9 * most("four-bar", 1.0)), 1000.0, 100.0)
    assert not r.events
    assert max(np.ptp(r[f"p{i}.q[1]"]) for i in range(4)) <= np.radians(1e-12)
