"""Motors whose torque is a linear function of speed: run-up, working point, braking and power, in the tree, at cuts and in both
kernels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import trunnion
from tests.engine.parts.test_compiled_kernel_equivalence import agree
from tests.engine.parts.test_jacobian import agree as derivatives_agree
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import simulate

STALL, NO_LOAD, INERTIA, ROTOR = 3.0, 50.0, 0.4, 0.1
CLOSE = 1e-9
KERNELS = ("parts", "compiled")


def shaft(motor: sm.Motor, **more) -> sm.Scene:
    """A flywheel on a motor."""
    inputs = more.pop("inputs", {})
    joint = sm.Joint("revolute", "ground", "wheel", axis="z", motor=motor, rotor_inertia=ROTOR, **more)
    wheel = sm.Body(mass=2.0, inertia=(0.3, 0.3, INERTIA))
    return sm.Scene({"wheel": wheel}, {"shaft": joint}, "runup", gravity=(0.0, 0.0, 0.0), inputs=inputs)


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("signal", [1.0, 0.4, -0.7])
def test_a_motor_accelerates_by_its_exponential(kernel: str, signal: float) -> None:
    """(J + A) ω̇ = T (s − ω/ω0): ω = s ω0 (1 − exp(−t/τ)), τ = (J + A) ω0/T."""
    r = simulate(shaft(sm.Motor(STALL, NO_LOAD, signal)), until=20.0, rtol=1e-11, kernel=kernel)
    rise = np.exp(-r.time / ((INERTIA + ROTOR) * NO_LOAD / STALL))
    assert r["shaft.qd[1]"] == pytest.approx(signal * NO_LOAD * (1 - rise), abs=CLOSE * NO_LOAD)
    assert r["shaft.motor.effort[1]"] == pytest.approx(signal * STALL * rise, abs=CLOSE * STALL)
    assert r["shaft.motor.power[1]"] == pytest.approx(signal**2 * STALL * NO_LOAD * rise * (1 - rise), abs=1e-8 * STALL * NO_LOAD)
    assert np.abs(r["energy.residual"]).max() <= CLOSE * r["energy.kinetic"].max()


def test_a_motor_with_drag_comes_to_where_its_line_meets_the_drag_or_stalls() -> None:
    drag = sm.Friction(torque=1.0)
    r = simulate(shaft(sm.Motor(STALL, NO_LOAD), friction=drag), until=200.0, every=200.0, rtol=1e-10)
    assert r["shaft.qd[1]"][-1] == pytest.approx(NO_LOAD * (1 - 1.0 / STALL), rel=1e-8)
    for share, turns in ((1 + 1e-6, True), (1 - 1e-6, False)):
        r = simulate(shaft(sm.Motor(STALL, NO_LOAD, share / STALL), friction=drag), until=1.0, every=1.0)
        assert (r["shaft.q[1]"][-1] != 0.0) == turns
        assert trunnion.hold(shaft(sm.Motor(STALL, NO_LOAD, share / STALL), friction=drag)).holds == (not turns)


def test_a_shorted_motor_brakes_and_an_input_steers_a_motor() -> None:
    r = simulate(shaft(sm.Motor(STALL, NO_LOAD, 0.0), start=sm.Start(qd=20.0)), until=5.0, rtol=1e-11)
    rise = np.exp(-r.time * STALL / NO_LOAD / (INERTIA + ROTOR))
    assert r["shaft.qd[1]"] == pytest.approx(20.0 * rise, abs=CLOSE * 20.0)
    scene = shaft(sm.Motor(STALL, NO_LOAD, sm.FromInput("volts")), inputs={"volts": sm.Input(start=0.5)})
    found = trunnion.linearize(scene)
    assert found.A[1, 1] == pytest.approx(-STALL / NO_LOAD / (INERTIA + ROTOR), rel=1e-12)
    assert found.B[1, 0] == pytest.approx(STALL / (INERTIA + ROTOR), rel=1e-12)


def test_a_motor_on_one_of_two_freedoms_acts_as_a_force_and_both_kernels_agree() -> None:
    sled = sm.Joint("cylindrical", "ground", "wheel", axis="z", motor=(sm.Motor(8.0, 2.0), None), damping=(None, 0.1))
    scene = replace(shaft(sm.Motor(STALL, NO_LOAD)), joints={"sled": sled})
    r = simulate(scene, until=1.0, rtol=1e-11)
    assert r["sled.qd[1]"] == pytest.approx(2.0 * (1 - np.exp(-r.time * 8.0 / 2.0 / 2.0)), abs=CLOSE)
    for s in (scene, shaft(sm.Motor(STALL, NO_LOAD, sm.Signal(harmonic=sm.Harmonic(1.0, 2.0))))):
        agree(s)
        derivatives_agree(s)


def test_a_drive_on_the_same_joint_takes_the_effort_that_a_motor_leaves() -> None:
    drive = sm.Drive(constant=sm.Constant(rate=20.0))
    r = simulate(shaft(sm.Motor(STALL, NO_LOAD), drive=drive), until=0.1)
    assert r["shaft.drive.effort[1]"] == pytest.approx(np.full(len(r), -STALL * (1 - 20.0 / NO_LOAD)), rel=1e-12)
