"""Examples 8.2 and 8.3 with dry friction: reversals in closed form, and a minute that ends at rest."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from tests.engine.mechanisms.ball_pendulum_and_arm import run
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate

UPRIGHT = math.pi / 20 + math.pi / 10 * np.arange(6)


@cache
def crank(until: float = 2.0, every: float = 0.1) -> Result:
    return run("crank_slider", until, every)


def test_the_slider_pin_reverses_when_the_crank_stands_across_the_guide() -> None:
    r = crank()
    assert [e.time for e in r.events] == pytest.approx(UPRIGHT, abs=1e-11)  # the required accuracy is 1e-9 s
    assert {(e.kind, e.joint) for e in r.events} == {("reversal", "slider_pin")}


def test_the_slider_pins_normals_turn_as_computed() -> None:
    """The normals turn alternately by 33.083° and 33.029°, to the printed digits (theory, "Turns of normals")."""
    for e, expected in zip(crank().events, (33.083, 33.029) * 3, strict=True):
        assert np.degrees(e.turn) == pytest.approx([expected] * 2, abs=5e-4)


def lean(t: float) -> float:
    """Angle from the reaction on the pin to the normal of its contact, about the pin's axis, degrees. Each of the two contacts
    carries half of the reaction."""
    r = crank(t, t)
    n = [r[f"slider_pin.contact[1].normal[{k}]"][-1] for k in (2, 3)]
    f = [-r[f"slider_pin.reaction.force[{k}]"][-1] for k in (2, 3)]
    return math.degrees(math.atan2(f[0] * n[1] - f[1] * n[0], f[0] * n[0] + f[1] * n[1]))


@pytest.mark.parametrize("k", [0, 1])
def test_at_a_reversal_the_angle_between_normal_and_reaction_flips_by_twice_the_friction_angle(k: int) -> None:
    flip = lean(UPRIGHT[k] + 1e-9) - lean(UPRIGHT[k] - 1e-9)
    assert abs(flip) == pytest.approx(2 * math.degrees(math.atan(0.3)), abs=1e-7)  # required: 33.39849 degrees to 1e-5
    assert abs(flip) == pytest.approx(33.39849, abs=1e-5)


@pytest.mark.parametrize(
    ("t", "along", "across", "torque"),
    [(0.05, -3682.15986, 1368.19074, 11.2874138), (0.1, -1078.24889, 1037.43376, 4.29956317)],
)
def test_the_slider_pins_forces_are_those_in_closed_form(t: float, along: float, across: float, torque: float) -> None:
    """Forces in N and torque in N m, to the digits of F2 (theory, "Reference numbers")."""
    r = crank(t, t)
    force = [r[f"slider_pin.reaction.force[{k}]"][-1] for k in (1, 2, 3)]
    assert sorted(np.abs(force))[1:] == pytest.approx(sorted((abs(along), abs(across))), abs=1e-5)
    assert abs(r["slider_pin.friction.torque[1]"][-1]) == pytest.approx(torque, abs=1e-7)
    f = [r[f"slider_pin.contact[{i}].normal_force"][-1] for i in (1, 2)]
    assert f[0] == pytest.approx(f[1], rel=1e-9)


@cache
def double(rtol: float, until: float = 60.0) -> Result:
    return run("double_pendulum", until, until / 240, rtol)


def test_the_double_pendulum_runs_a_minute_and_its_pivot_rests_once_it_has_stopped() -> None:
    r = double(1e-7)
    late = r.time >= 50.0
    assert np.all(r["guide.qd[1]"][late] == 0.0)  # exactly 0, although the speed was 0.01 m/s
    assert np.ptp(r["guide.q[1]"][late]) == 0.0
    # the travel is about 13.75 m; it is sensitive to the geometry after the first second
    assert r["guide.q[1]"][-1] == pytest.approx(13.75, abs=0.1)
    energy = np.abs(r["energy.kinetic"]).max()
    assert np.abs(r["energy.residual"]).max() <= 1e-4 * energy
    work = np.gradient(r["energy.dissipated"], r.time)
    assert work.min() >= -1e-9 * energy


def test_the_double_pendulum_starts_as_computed() -> None:
    r = run("double_pendulum", 1.0, 0.25, 1e-9)
    # the values of the regularised law with v_eps = 1e-4
    assert r["guide.q[1]"][[1, 2, 4]] == pytest.approx([2.45822549, 4.71556293, 8.32814917], abs=2e-5)


def test_events_of_the_double_pendulum_converge_as_the_tolerance_falls() -> None:
    """The test compares times of the first stops with the times at 1e-11. The motion is sensitive: the errors are up to 30 times
    the tolerance over two seconds."""
    every = {r: run("double_pendulum", 2.0, 1.0, r).events for r in (1e-6, 1e-8, 1e-11)}
    runs = {r: [e.time for e in events if e.kind != "contact_jump"] for r, events in every.items()}
    truth = runs.pop(1e-11)
    assert len(truth) >= 3
    for rtol, times in runs.items():
        assert len(times) == len(truth)
        assert times == pytest.approx(truth, abs=30 * rtol), rtol


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("method", ["rk5", "rk8", "rosenbrock"])
def test_with_fixed_steps_the_pivot_comes_through_its_stops_and_the_error_falls_with_the_step(method: str) -> None:
    """The guide of 8.3 has sliding with two components, and stops inside a step. The engine divides this step. A run therefore
    takes a few steps more than its duration divided by the step."""
    fine, errors = run("double_pendulum", 4.0, 0.1, rtol=1e-10), []
    for step in (4e-3, 2.5e-4):
        r = simulate("double_pendulum", until=4.0, every=0.1, method=method, step=step)
        assert r.outcome.ok
        assert 4.0 / step <= r.stats.steps <= 4.0 / step + 4 * len(r.events) + 100
        errors.append(np.abs(r["cross.q[1]"] - fine["cross.q[1]"]).max())
    # steps are 16 times shorter; errors of first order at changes of friction would fall by a factor of 16
    assert errors[1] < 0.25 * errors[0] < 0.01
