"""Contact columns along a run: contact or separation, angles, sliding states, work."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from tests.paper_friction_law import PAPER
from tests.stability.equivalent_scenes import told
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate

PUSH = 4.0


@cache
def relieved() -> Result:
    """A wheel on a journal, without gravity, with its mass centre on the axis. A force presses the wheel until t = 1; then no force
    acts."""
    rub = sm.Friction(mu=0.3, radius=0.02, half_length=0.05, law="regularized", v_eps=1e-3)
    joint = sm.Joint("revolute", "ground", "wheel", axis="z", friction=rub, start=sm.Start(0.0, 5.0))
    press = sm.Signal(table=sm.Table((0.0, 0.5, 1.0), (PUSH, PUSH, 0.0)))
    force = sm.Force("force", "wheel", (press, 0.0, 0.0))
    wheel = sm.Body(cylinder=sm.Cylinder(radius=0.1, length=0.04, axis="z"), mass=1.0)
    scene = sm.Scene({"wheel": wheel}, {"pin": joint}, "relieved", gravity=(0.0, 0.0, 0.0), forces={"press": force})
    return simulate(scene, until=2.0, every=0.01, rtol=1e-9)


def test_contacts_open_when_nothing_presses_and_keep_their_last_angle() -> None:
    r = relieved()
    pressed = r.time < 1.0 - 1e-9
    for i in (1, 2):
        c = f"pin.contact[{i}]"
        assert np.all(r[f"{c}.state"][pressed] == 1.0)
        assert np.all(r[f"{c}.state"][~pressed] == 0.0)
        assert np.all(np.abs(r[f"{c}.normal_force"][~pressed]) <= 1e-140)
        assert np.ptp(r[f"{c}.angle"]) <= 1e-12  # the direction of the load is constant
        assert abs(r[f"{c}.angle"][-1]) > 0.1  # the angle keeps its last value; an undefined angle would be zero


def test_without_pressure_there_is_no_friction_and_the_spin_stays() -> None:
    r = relieved()
    free = r.time > 1.0 + 1e-9
    assert np.all(np.abs(r["pin.friction.torque[1]"][free]) <= 1e-140)
    assert np.ptp(r["pin.qd[1]"][free]) == 0.0
    assert r["pin.qd[1]"][0] > r["pin.qd[1]"][-1] > 0.0


def test_friction_takes_the_spin_that_its_torque_says() -> None:
    """ΔL = ∫ r μ/√(1+μ²) |f| dt. The load is 4 N for 0.5 s, and then falls to zero within another 0.5 s."""
    r = relieved()
    R = 0.02 * 0.3 / np.sqrt(1.09)
    inertia = 0.1**2 / 2
    assert r["pin.qd[1]"][-1] == pytest.approx(5.0 - R * PUSH * 0.75 / inertia, abs=1e-8)
    lost = inertia / 2 * (25.0 - r["pin.qd[1]"][-1] ** 2)
    assert r["pin.friction.work"][-1] == pytest.approx(-lost, abs=1e-8)


def test_the_sliding_state_is_the_sign_of_the_rate_beyond_the_kink_and_zero_within() -> None:
    r = simulate("crank_slider", until=1.0, every=0.0007, rtol=1e-9, overrides=PAPER)
    speed = 0.01 * r["slider_pin.qd[1]"]
    expected = np.where(np.abs(speed) > 1e-4, np.sign(speed), 0.0)
    assert np.array_equal(r["slider_pin.friction.state[1]"], expected)
    assert set(expected) == {-1.0, 0.0, 1.0}


def test_each_journal_of_a_cross_has_a_state_of_its_own() -> None:
    r = simulate("double_pendulum", until=0.5, every=0.002, rtol=1e-9, overrides=PAPER)
    for k in (1, 2):
        speed = 0.01 * r[f"cross.qd[{k}]"]
        clear = np.abs(np.abs(speed) - 1e-4) > 1e-9
        expected = np.where(np.abs(speed) > 1e-4, np.sign(speed), 0.0)
        assert np.array_equal(r[f"cross.friction.state[{k}]"][clear], expected[clear])
    assert np.all(r["guide.friction.state[1]"] == 1.0)  # 1 means sliding; two simultaneous components have no sign


def test_work_by_joint_adds_up_to_what_was_dissipated() -> None:
    r = simulate("double_pendulum", until=1.0, every=0.01, overrides=PAPER)
    work = r["guide.friction.work"] + r["cross.friction.work"]
    assert work == pytest.approx(-r["energy.dissipated"], abs=1e-9)
    for joint in ("guide", "cross"):
        assert np.all(np.diff(r[f"{joint}.friction.work"]) <= 0.0)
    power = r["guide.friction.force"] * r["guide.qd[1]"] + r["guide.friction.torque[1]"] * r["guide.qd[2]"]
    # the error of the trapezoidal rule on rows 10 ms apart
    assert -np.trapezoid(power, r.time) == pytest.approx(r["guide.friction.work"][-1], rel=1e-4)


def rail() -> sm.Scene:
    """A pole is hinged to a cart. The rail presses on only two faces of the cart, because the pole swings in the plane of these
    faces."""
    rub = sm.Friction(mu=0.4, half_length=0.08, half_width=0.03, half_height=0.02)
    bodies = {
        "cart": sm.Body(box=(0.1, 0.1, 0.1), mass=1.0),
        "pole": sm.Body(box=(0.05, 0.05, 1.0), mass=1.0, center=(0.0, 0.0, -0.5)),
    }
    joints = {
        "rail": sm.Joint("prismatic", "ground", "cart", axis="x", friction=rub, start=sm.Start(0.0, 0.0)),
        "hinge": sm.Joint("revolute", "cart", "pole", axis="y", start=sm.Start(0.3, 0.0)),
    }
    return sm.Scene(bodies, joints, "rail")


@pytest.mark.parametrize("seed", [1, 2, 9])
def test_faces_that_carry_nothing_but_round_off_do_not_separate(seed: int) -> None:
    r = simulate(told(rail(), "turned", seed), until=1.0, rtol=1e-8)
    assert r.outcome.ok
    assert 0.0 < r["rail.contact[1].normal_force"].max() < 1e-9  # in a turned world, a lateral face carries round-off
    assert not r.events
