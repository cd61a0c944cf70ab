"""A box on two corners slides, tips, rocks and lands flat."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.default_case_selection import crossed
from tests.engine.unilateral.test_impacts import CLOSE, times
from tests.engine.unilateral.unilateral_scenes import G, box
from trunnion.simulation.run import simulate

MASS, INERTIA, HALF, HEIGHT = 2.0, 0.1, 0.2, 0.5
RAMP = {"ramp": {"start": 0.0, "end": 30.0, "duration": 3.0}}
"""A force of 10 N/s at the mass centre, along x."""


def standing(mu: float, effort: object = RAMP):
    return box(mu, HALF, HEIGHT, MASS, INERTIA, (HEIGHT, 0.0, 0.0), (0.0, 0.0, 0.0), effort)


@pytest.mark.parametrize(("kernel", "method"), crossed(("parts", "compiled"), ("rk5", "rosenbrock", "auto")))
def test_a_pushed_box_tips_where_friction_holds_it_and_slides_where_it_does_not(kernel: str, method: str) -> None:
    """The box tips about its corner at F h = m g b, and slides at F = μ m g. The smaller of the two forces decides."""
    r = simulate(standing(0.8), until=1.1, rtol=1e-10, kernel=kernel, method=method)
    tips = MASS * G * HALF / HEIGHT / 10.0
    assert [(e.kind, e.joint) for e in r.events] == [("contact_opened", "left")]
    assert times(r, "contact_opened") == pytest.approx([tips], abs=CLOSE)
    reach, low = np.hypot(HALF, HEIGHT), np.arctan2(HALF, HEIGHT)

    def turn(t: float, y: np.ndarray) -> list[float]:
        x, z = -reach * np.sin(low - y[0]), reach * np.cos(low - y[0])
        return [y[1], (10.0 * t * z + MASS * G * x) / (INERTIA + MASS * reach**2)]

    s = solve_ivp(turn, (tips, r.time[-1]), [0.0, 0.0], "DOP853", rtol=1e-12, atol=1e-14)
    assert r["fly.q[3]"][-1] == pytest.approx(s.y[0, -1], abs=1e-9)
    assert r["fly.qd[3]"][-1] == pytest.approx(s.y[1, -1], abs=1e-8)
    assert r.audit.verdict == "within"
    slides = simulate(standing(0.3), until=0.8, rtol=1e-10, kernel=kernel, method=method)
    assert {e.kind for e in slides.events} == {"slip"}
    assert times(slides, "slip", "left") == pytest.approx([0.3 * MASS * G / 10.0], abs=CLOSE)
    assert np.abs(slides["fly.q[3]"]).max() < 1e-12


@pytest.mark.parametrize("kernel", ["parts", "compiled"])
def test_a_rocking_box_keeps_the_share_of_speed_that_angular_momentum_leaves(kernel: str) -> None:
    """A box that stands on its right corner falls back. At the impact of the left corner, the right corner opens. The box then
    turns about the left corner. The remaining share of its speed is (I + m (h² − b²))/(I + m (h² + b²)) (Housner)."""
    reach, low, tilt = np.hypot(HALF, HEIGHT), np.arctan2(HALF, HEIGHT), 0.1
    at = (reach * np.cos(low - tilt), HALF - reach * np.sin(low - tilt), tilt)
    made = box(0.9, HALF, HEIGHT, MASS, INERTIA, at, (0.0, 0.0, 0.0), starts="open")
    r = simulate(made, until=0.4, rtol=1e-11, kernel=kernel)
    own = INERTIA + MASS * reach**2
    speed = np.sqrt(2 * MASS * G * (reach * np.cos(low - tilt) - HEIGHT) / own)
    share = (INERTIA + MASS * (HEIGHT**2 - HALF**2)) / own
    hit = times(r, "contact_closed", "left")[0]
    assert hit in times(r, "contact_opened", "right")
    energy = r["energy.kinetic"] + r["energy.potential"] - MASS * G * HEIGHT
    assert energy[r.time < hit][-1] == pytest.approx(0.5 * own * speed**2, rel=1e-9)
    assert energy[-1] == pytest.approx(0.5 * own * (speed * share) ** 2, rel=1e-8)
    assert r.audit.verdict == "within"


@pytest.mark.parametrize(("restitution", "law"), [(0.0, "newton"), (0.5, "newton"), (0.5, "poisson")])
def test_a_box_that_falls_flat_lands_on_both_corners_at_once_and_comes_to_rest(restitution: float, law: str) -> None:
    more = {"restitution": restitution, "impact_law": law, "starts": "open"}
    made = box(0.3, HALF, HEIGHT, MASS, INERTIA, (HEIGHT + 0.2, 0.0, 0.0), (0.0, 1.0, 0.0), **more)
    r = simulate(made, until=2.5, rtol=1e-10)
    assert r.outcome.ok, r.outcome
    assert times(r, "contact_closed", "left")[0] == pytest.approx(np.sqrt(0.4 / G), abs=CLOSE)
    assert r["fly.q[1]"][-1] == pytest.approx(HEIGHT, abs=1e-12)
    assert np.abs([r[f"fly.qd[{k}]"][-1] for k in (1, 2, 3)]).max() < 1e-12
    assert r.audit.verdict == "within"


@pytest.mark.parametrize("kernel", ["parts", "compiled"])
def test_a_falling_box_has_a_gap_until_it_lands_and_a_force_afterwards(kernel: str) -> None:
    made = box(0.3, 0.2, 0.5, 1.0, 0.1, (0.9, 0.0, 0.0), (0.0, 0.0, 0.0), starts="open")
    r = simulate(made, until=0.6, every=0.01, kernel=kernel)
    fall = np.sqrt(0.8 / G)
    assert r["left.gap"] == pytest.approx(np.where(r.time < fall, 0.4 - G * r.time**2 / 2, 0.0), abs=1e-12)
    force = np.abs(r["left.reaction.force[2]"])
    assert force == pytest.approx(np.where(r.time < fall, 0.0, 0.5 * G), rel=1e-9, abs=1e-12)
