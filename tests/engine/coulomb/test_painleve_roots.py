"""Painlevé (theory, "Reference numbers", F4).

The complement equations of 8.1 have one root while R = r μ/√(1+μ²) < I/(m l), else none or two."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.default_case_selection import sampled
from tests.reference import every_root, forward
from tests.reference.scenes.paper_examples import ball_pendulum, pendulum_start
from tests.stability.entries.ball_pendulums import MU, PAINLEVE, pendulum
from tests.stability.equivalent_scenes import told
from tests.stability.scene_verdicts import ran

STATES = ((0.4, 1.0), (-1.2, 3.0), (1.0, -2.0), (0.3, -0.5))
BELOW = [(*state, share) for state, share in zip(STATES, (0.5, 0.9, 0.99, 0.99), strict=True)]
ABOVE = [(*state, share) for state, share in zip(STATES, (1.01, 1.1, 1.1, 1.01), strict=True)]
"""States, and radii relative to the threshold's, that run by default."""


def product_of(states: tuple, shares: tuple) -> list[tuple]:
    """Every state with every radius."""
    return [(*state, share) for state in states for share in shares]


def independent(radius: float, angle: float, rate: float) -> int:
    """The roots that the reference finds from many starts. The reference shares no code with the engine."""
    state = forward(ball_pendulum(mu=MU, radius=radius, law="coulomb"), *pendulum_start(angle, rate))
    return len(every_root(state, starts=25, spread=20.0))


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(("angle", "rate", "share"), sampled(product_of(STATES, (0.5, 0.9, 0.99)), BELOW))
def test_the_one_root_below_the_threshold_is_found(angle: float, rate: float, share: float) -> None:
    assert independent(share * PAINLEVE, angle, rate) == 1
    r = ran(pendulum(angle, share * PAINLEVE, rate, 1e-6))
    assert r.outcome.ok
    assert r.certificate.roots[0] == 1


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(("angle", "rate", "share"), sampled(product_of(STATES, (1.01, 1.1)), ABOVE))
def test_above_the_threshold_no_root_ends_the_run_and_two_roots_are_counted(angle: float, rate: float, share: float) -> None:
    count = independent(share * PAINLEVE, angle, rate)
    assert count in (0, 2)
    r = ran(pendulum(angle, share * PAINLEVE, rate, 1e-6))
    if count == 0:
        assert r.outcome.name in ("jammed", "inconsistent")
        assert (r.outcome.joint, r.outcome.time) == ("ball", 0.0)
    else:
        assert r.outcome.ok
        assert r.certificate.roots[0] == 2


def test_the_pendulum_has_a_known_acceleration() -> None:
    """At R = 0.0257 m, 60° and 2 rad/s, the acceleration is −13.261857 rad/s² (F4)."""
    r = ran(pendulum(math.pi / 3, 0.0257 * math.hypot(1, MU) / MU, 2.0, 1e-6))
    assert abs(r["ball.qdd[2]"][0]) == pytest.approx(13.261857, abs=5e-7)
    assert np.sign(r["ball.qdd[2]"][0]) == -np.sign(r["ball.qd[2]"][0])


@pytest.mark.parametrize("below", [1e-4, 1e-6])
def test_a_pendulum_just_below_the_threshold_stops_and_stays(below: float) -> None:
    for seed in range(4):
        r = ran(told(pendulum(1.0, PAINLEVE * (1 - below), -2.0, 0.02), "turned", seed))
        assert r.outcome.ok, seed
