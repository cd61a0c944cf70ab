"""Moreau's time stepping: first order, the same rest, the same loops, and no law that is stiff near rest."""

from __future__ import annotations

import numpy as np
import pytest

from engine.basics.problems import SceneError
from engine.simulation.run import simulate

COULOMB = {"friction.law": "coulomb"}


def swing(step: float) -> float:
    """Angle of example 8.1 at 2 s for a step in s, degrees from the downward vertical."""
    r = simulate("spherical_pendulum", until=2.0, every=1.0, method="moreau", step=step, overrides=COULOMB)
    return float(np.degrees(np.arctan2(r["pendulum.position[1]"][-1], -r["pendulum.position[3]"][-1])))


def test_its_error_is_first_order_in_the_step() -> None:
    """The angle at 2 s is 57.500835748° (F1). Ten times smaller steps make about ten times smaller errors."""
    coarse, fine = (abs(swing(h) - 57.500835748) for h in (1e-2, 1e-3))
    assert fine < 0.01
    assert 5.0 < coarse / fine < 20.0


def test_the_pendulum_comes_to_rest_and_stays() -> None:
    r = simulate("spherical_pendulum", until=12.0, every=0.5, method="moreau", step=1e-3, overrides=COULOMB)
    late = r.time > 9.6
    assert np.all(r["ball.qd[2]"][late] == 0.0)
    assert [e.kind for e in r.events].count("stop") >= 1
    assert np.degrees(np.ptp(r["pendulum.position[1]"][late])) == 0.0


def test_loops_stay_closed() -> None:
    r = simulate("crank_slider", until=1.0, every=0.01, method="moreau", step=1e-3, overrides=COULOMB)
    assert r.outcome.ok
    assert r["audit.constraint"].max() <= 1e-13  # rounding errors of lengths of about 1 m


def test_two_component_sliding_follows_the_located_run() -> None:
    """Example 8.3 travels as far as in the event-driven run, with an error of the order of the step."""
    r = simulate("double_pendulum", until=1.0, every=0.25, method="moreau", step=1e-4, overrides=COULOMB)
    assert r["guide.q[1]"][[1, 2, 4]] == pytest.approx([2.45822543, 4.71556233, 8.32814713], abs=1e-4)


@pytest.mark.parametrize("law", ["regularized"])
def test_a_law_that_is_stiff_near_rest_is_refused(law: str) -> None:
    with pytest.raises(SceneError, match="moreau"):
        simulate("spherical_pendulum", until=0.1, method="moreau", step=1e-3, overrides={"friction.law": law})
