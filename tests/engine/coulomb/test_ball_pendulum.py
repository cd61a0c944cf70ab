"""Example 8.1 with dry friction (theory, "Reference numbers", F1): every stop, the rest at the end, and stick within the friction
cone."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from tests.engine.mechanisms.ball_pendulum_and_arm import pendulum_angle, pendulum_at, run
from trunnion.simulation.results.result import Result

STOPS = (
    (0.944980, -76.609899), (1.852048, 65.533511), (2.733826, -55.976277), (3.597649, 47.486706), (4.448284, -39.776212),
    (5.289065, 32.645363), (6.122459, -25.947802), (6.950383, 19.570467), (7.774398, -13.421739), (8.595831, 7.423793),
    (9.415871, -1.507240),
)  # fmt: skip
"""Stops as (time in s, degrees from the downward vertical), from an independent integration that locates every event."""
INERTIA, MASS, ARM, RADIUS, MU = 26.065, 78.0, 0.5, 0.05, 0.6


@cache
def swing(rtol: float = 1e-9) -> Result:
    return run("spherical_pendulum", 12.0, 1.0, rtol)


def stops(r: Result) -> list[float]:
    return [e.time for e in r.events if e.kind in ("reversal", "stick")]


def test_the_pendulum_stops_eleven_times_at_the_known_times_and_then_rests() -> None:
    r = swing()
    assert stops(r) == pytest.approx([t for t, _ in STOPS], abs=1e-6)  # the required accuracy is 1e-5 s
    assert [e.kind for e in r.events] == ["reversal"] * 10 + ["stick"]
    late = r.time > STOPS[-1][0]
    assert np.all(r["ball.qd[2]"][late] == 0.0)
    assert np.ptp(pendulum_angle(r)[late]) == 0.0


@pytest.mark.default_cases(4)
@pytest.mark.parametrize("stop", range(11))
def test_the_pendulum_stops_at_the_known_angles(stop: int) -> None:
    time, angle = STOPS[stop]
    r = run("spherical_pendulum", stops(swing())[stop], 0.0, 1e-9)
    assert pendulum_angle(r)[-1] == pytest.approx(angle, abs=1e-6)  # the required accuracy is 1e-5 degrees; STOPS is exact to 5e-7
    assert r.time[-1] == pytest.approx(time, abs=1e-6)


def test_the_angle_is_that_of_the_reference_with_exact_events() -> None:
    """Angles in degrees. The reference at 7 s has nine decimals, and the required accuracy is 1e-8."""
    angle = pendulum_angle(swing(1e-12))
    assert angle[2] == pytest.approx(57.500835748, abs=1e-8)
    assert angle[7] == pytest.approx(19.275178967, abs=1e-8)


def test_the_error_falls_with_the_tolerance() -> None:
    truth = pendulum_angle(swing(1e-12))[7]
    errors = [abs(math.radians(pendulum_angle(swing(r))[7] - truth)) for r in (1e-5, 1e-7, 1e-9)]
    assert all(e <= 10 * r for e, r in zip(errors, (1e-5, 1e-7, 1e-9), strict=True)), errors


@pytest.mark.parametrize(("stop", "turn"), [(1, 58.8975), (5, 57.610)])
def test_the_normal_turns_as_the_reaction_jumps(stop: int, turn: float) -> None:
    """Angle, degrees, by which the normal turns: 2 atan μ less the turn of the reaction (theory, "Turns of normals"). The values
    agree to the printed digits."""
    (found,) = swing(1e-12).events[stop - 1].turn
    assert math.degrees(found) == pytest.approx(turn, abs=5e-4)


def test_a_ball_pendulum_with_adams_friction_stops_at_the_time_of_that_program() -> None:
    """Adams uses the friction r μ |f| (151) instead of r μ |f|/√(1+μ²). With this friction, the ball stops at 7.719710 s. The paper
    reads 7.7 s from its figure."""
    r = run("spherical_pendulum", 8.0, 1.0, 1e-11, friction__normal_force="adams")
    assert min(abs(t - 7.719710) for t in stops(r)) <= 1e-6


LIMIT = math.degrees(math.asin(RADIUS * MU / math.sqrt(1 + MU * MU) / ARM))
"""Largest angle of rest, 2.949146 degrees: l sin θ = R, where the weight acts at R = r μ/√(1+μ²) from the centre."""


@pytest.mark.parametrize("angle", [2.0, 2.949, LIMIT - 1e-8, -2.949])
def test_a_ball_pendulum_inside_its_friction_cone_holds_for_ever(angle: float) -> None:
    r = pendulum_at(angle, 100.0, 1000.0)
    assert not r.events
    assert np.abs(pendulum_angle(r) - angle).max() <= 1e-12


@pytest.mark.parametrize("angle", [2.95, LIMIT + 1e-8, -2.95])
def test_a_ball_pendulum_outside_its_friction_cone_slips(angle: float) -> None:
    r = pendulum_at(angle, 0.1, 1.0)
    assert abs(pendulum_angle(r)[-1]) < abs(angle)


def test_static_friction_holds_what_sliding_friction_would_not() -> None:
    """With a μ_static of 0.8, the pendulum holds up to asin(r 0.8/√1.64/l) = 3.5808 degrees. Once the ball slides, its friction
    coefficient is 0.6."""
    limit = math.degrees(math.asin(RADIUS * 0.8 / math.sqrt(1.64) / ARM))
    held = pendulum_at(limit - 1e-6, 10.0, 100.0, mu_static=0.8)
    assert np.ptp(pendulum_angle(held)) == 0.0
    gone = pendulum_at(limit + 1e-6, 0.001, 0.01, mu_static=0.8)
    weight, reach, sine = MASS * 9.81, RADIUS * MU / math.sqrt(1 + MU * MU), math.sin(math.radians(limit))
    rate = abs(gone["ball.qdd[2]"][0])
    cosine = math.cos(math.radians(limit))
    force = math.hypot(weight * sine - MASS * ARM * rate, weight * cosine)
    assert INERTIA * rate == pytest.approx(weight * ARM * sine - reach * force, rel=1e-5)
