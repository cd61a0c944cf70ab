"""Motions that follow inputs. A host sets the inputs without derivatives, or sets rates and accelerations as further inputs."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import trunnion
from tests.fmu.exported_fmus import FOLDER, exported
from tests.fmu.fmpy_host import Host
from tests.fmu.systems.scenarios import motor_and_crank
from trunnion.fmu.scene_export import export

BOTH = pytest.mark.parametrize("flavour", ["native", "python"])
END, RATE, ACCELERATION = 1.0, "inputs.angle.rate", "inputs.angle.acceleration"


@cache
def made(part: str) -> Path:
    """The FMU of the motor, or of the crank-slider whose crank follows an angle."""
    file = FOLDER / f"coupled-{part}.fmu"
    export(motor_and_crank.motor() if part == "motor" else motor_and_crank.crank_slider(), file)
    return file


def coupled(step: float, derivatives: int = 0, **settings: float) -> float:
    """The motor's angle at END. A host steps motor and crank-slider side by side. At communication points it passes values, and
    this number of derivatives of the angle."""
    drive, load = Host(made("motor")), Host(made("crank"), **settings)
    for k in range(round(END / step)):
        q, rate, acceleration = drive.get("shaft.q[1]", "shaft.qd[1]", "shaft.qdd[1]")
        if k:
            drive.put("load", -load.get(motor_and_crank.LOAD)[0])
            load.put("angle", q)
        for name, value in ((RATE, rate), (ACCELERATION, acceleration))[:derivatives]:
            load.put(name, value)
        for part in (drive, load):
            part.fmu.doStep(k * step, step)
    return drive.get("shaft.q[1]")[0]


@cache
def whole() -> float:
    """The motor's angle at END when motor and crank-slider are one scene."""
    return float(trunnion.simulate(motor_and_crank.one_scene(), until=END, every=END, rtol=1e-9)["crank_pivot.q[1]"][-1])


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("bandwidth", [20.0, 100.0, 400.0])
def test_coupled_without_derivatives_the_error_is_of_first_order_in_the_step(bandwidth: float) -> None:
    """The motor gets the load of the previous step, which causes the only error of first order. For any bandwidth, the error halves
    with the step. The error falls faster where its second-order part is large."""
    errors = np.array([abs(coupled(h, inputs__angle__bandwidth=bandwidth) - whole()) for h in (0.01, 0.005, 0.0025)])
    assert errors[0] < 0.07
    assert (errors[1:] / errors[:-1] < 0.55).all()


def test_a_coupled_run_without_derivatives_or_with_the_rate_alone_is_about_as_accurate_as_with_both() -> None:
    plain, rate, both = (abs(coupled(0.005, derivatives=n) - whole()) for n in range(3))
    assert max(plain, rate) < 2.0 * both


def test_the_log_names_the_bandwidth_that_the_samples_carry() -> None:
    host = Host(exported("arm"), logging=True, inputs__angle__bandwidth=200.0)
    for k in range(10):
        host.set(angle=0.2 + 0.01 * k)
        host.fmu.doStep(0.01 * k, 0.01)
    said = [text for _, text in host.log if "bandwidth" in text]
    assert len(said) == 1
    assert said[0].startswith("inputs.angle.bandwidth = 200 rad/s is more than samples 0.01 s apart carry: ")
    assert "the motion follows with 20 rad/s" in said[0]


@BOTH
def test_rate_and_acceleration_as_inputs_act_as_derivatives_of_the_input(flavour: str) -> None:
    """Rate and acceleration are set before or after the value. The motion follows a parabola exactly."""
    told, before, after = (Host(exported("arm", flavour), angle=0.2) for _ in range(3))
    at = told.reference["angle"]
    for k in range(20):
        t = 0.02 * k
        value, rate = 0.2 + 2 * t * t, 4 * t
        told.set(angle=value)
        told.fmu.setRealInputDerivatives([at, at], [1, 2], [rate, 4.0])
        for name, x in ((RATE, rate), (ACCELERATION, 4.0), ("angle", value)):
            before.put(name, x)
        for name, x in (("angle", value), (RATE, rate), (ACCELERATION, 4.0)):
            after.put(name, x)
        found = []
        for host in (told, before, after):
            host.fmu.doStep(t, 0.02)
            found.append(host.get("hip.q[1]", "hip.qd[1]", "knee.qd[1]"))
        assert found[0] == found[1] == found[2]
        assert found[0][0] == pytest.approx(0.2 + 2 * (t + 0.02) ** 2, abs=1e-13)


def test_a_sampled_input_that_stops_is_reached() -> None:
    """The FMU does not assume that the input continues at its last rate."""
    host = Host(exported("arm"))
    for k in range(100):
        host.set(angle=0.2 + 0.01 * min(k, 10))
        host.fmu.doStep(0.01 * k, 0.01)
    assert host.get("hip.q[1]", "hip.qd[1]") == pytest.approx([0.3, 0.0], abs=1e-6)


def test_derivatives_with_rate_and_acceleration_are_those_of_differences() -> None:
    host = Host(exported("arm"))
    host.run(0.0, 13, 0.01)
    name = "hip.qdd[1]"
    for known, size in ((RATE, 1e-3), (ACCELERATION, 1e-2)):
        exact = host.fmu.getDirectionalDerivative([host.reference[name]], [host.reference[known]], [1.0])[0]
        found = []
        for sign in (1, -1):
            host.put(known, sign * size)
            found.append(host.get(name)[0])
        host.put(known, 0.0)
        assert exact == pytest.approx((found[0] - found[1]) / (2 * size), rel=1e-7)


def test_only_inputs_of_motions_have_rate_and_acceleration() -> None:
    names = Host(exported("arm")).reference
    assert {RATE, ACCELERATION} <= set(names)
    assert not [n for n in names if n.startswith("inputs.motor.")]


@pytest.mark.parametrize(("inertia", "diverges"), [(1.0, True), (50.0, False)])
def test_a_source_lighter_than_what_it_moves_is_reported(inertia: float, diverges: bool) -> None:
    """The test steps a rotor that moves the arm's hip. The arm's inertia about the hip is about 5 kg m²."""
    h, angle, rate, arm = 1e-3, 0.2, 0.0, Host(exported("arm"))
    for k in range(30):
        acceleration = arm.get("hip.drive.reaction[1]")[0] / inertia
        for name, value in (("angle", angle), (RATE, rate), (ACCELERATION, acceleration)):
            arm.put(name, value)
        arm.fmu.doStep(k * h, h)
        angle, rate = angle + h * rate + h * h / 2 * acceleration, rate + h * acceleration
    told = [text for _, text in arm.log]
    assert len(told) == diverges
    assert all(text.startswith("inputs.angle: the acceleration grows") and "give the source more inertia" in text for text in told)
