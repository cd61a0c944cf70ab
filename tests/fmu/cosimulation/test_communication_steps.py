"""Communication steps, states, inputs, parameters and refusals, in each flavour of FMU that supports them."""

from __future__ import annotations

import math
import threading
from itertools import pairwise

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

import trunnion
from tests.fmu.exported_fmus import FOLDER, exported
from tests.fmu.fmpy_host import Host
from trunnion.fmu.scene_export import export
from trunnion.scene import scene_from_dict, scene_to_dict

BOTH = pytest.mark.parametrize("flavour", ["native", "python"])
DO_STEP, LAST_SUCCESSFUL_TIME, TERMINATED = 0, 2, 3
"""Kinds of status in FMI 2.0."""
TIP = "pendulum.tip.position[3]"
KNEE = ("knee.q[1]", "knee.qd[1]", "hip.q[1]", "hip.drive.effort[1]")


def said(host: Host) -> str:
    """Messages of the FMU to the host's logger. The host has requested no log."""
    return " ".join(text for _, text in host.log)


def test_a_host_that_reads_the_contraction_which_steps_omit_gets_it_and_changes_nothing() -> None:
    """Computing the contraction takes a third of a step. Therefore the FMU computes the contraction only when a host reads it, from
    a copy of the run."""
    reader, other = (Host(exported("spherical_pendulum"), stop=1.0) for _ in range(2))
    read = [x for (x,) in reader.run(0.0, 100, 0.01, "audit.contraction")]
    other.run(0.0, 100, 0.01)
    assert all(x > 0.0 for x in read)
    assert other.get("audit.contraction") == [read[-1]]
    names = reader.all_outputs()
    assert reader.get(*names) == other.get(*names)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("model", ["arm", "crank_slider", "spherical_pendulum", "double_pendulum", "drawer"])
def test_a_host_that_reads_outputs_after_each_step_changes_nothing(model: str) -> None:
    """The FMU computes the outputs when a host reads them."""
    reader, other = (Host(exported(model), stop=0.4) for _ in range(2))
    for k in range(40):
        for host in (reader, other):
            if model == "arm":
                host.set(motor=math.sin(0.3 * k))
            host.fmu.doStep(k * 0.01, 0.01)
        reader.get(reader.all_outputs()[0])
    assert reader.get(*reader.all_outputs()) == other.get(*other.all_outputs())


@BOTH
def test_communication_steps_of_any_size_lead_to_the_same_motion(flavour: str) -> None:
    """While no input changes, internal steps do not depend on communication steps, so the results are equal."""
    file = exported("spherical_pendulum", flavour)
    ends = []
    for cuts in (np.linspace(0, 2, 3), np.linspace(0, 2, 2001), np.array([0, 0.001, 0.9, 0.94498, 0.95, 1.3, 2.0])):
        host = Host(file, stop=2.0)
        for a, b in pairwise(cuts):
            host.fmu.doStep(a, b - a)
        ends.append(host.get(TIP, "ball.friction.torque[2]", "events.count"))
    assert np.allclose(ends[0], ends[1], rtol=0, atol=1e-12)
    assert np.allclose(ends[0], ends[2], rtol=0, atol=1e-12)
    assert ends[0][2] >= 2


@pytest.mark.default_cases(1)
@BOTH
def test_inputs_that_do_not_change_do_not_disturb(flavour: str) -> None:
    calm, told = (Host(exported("arm", flavour), stop=1.0) for _ in range(2))
    for k in range(50):
        told.set(motor=0.5, angle=0.2)
        told.fmu.doStep(k * 0.01, 0.01)
        calm.fmu.doStep(k * 0.01, 0.01)
        assert told.get(*KNEE) == calm.get(*KNEE)


@BOTH
def test_a_state_restored_gives_the_same_bits_after_inputs_and_parameters(flavour: str) -> None:
    host = Host(exported("arm", flavour), stop=2.0)
    friction = "joints.knee.friction.mu"

    def go(start: int) -> list[list[float]]:
        out = []
        for k in range(start, start + 20):
            host.set(motor=math.sin(0.3 * k), angle=0.2 + 0.01 * k)
            if k == 35:
                host.put(friction, 0.3)
            host.fmu.doStep(k * 0.0123, 0.0123)
            out.append(host.get(*KNEE))
        return out

    go(0)
    kept = host.fmu.getFMUState()
    first = go(20)
    host.fmu.setFMUState(kept)
    assert host.get(friction) == [0.1]
    assert go(20) == first
    other = Host(exported("arm", flavour), stop=2.0)
    state = other.fmu.deSerializeFMUstate(host.fmu.serializeFMUState(kept))
    other.fmu.setFMUState(state)
    host = other
    assert go(20) == first


@BOTH
def test_a_motion_follows_its_input_critically_damped(flavour: str) -> None:
    host = Host(exported("arm", flavour))
    host.set(angle=0.5)
    w, h = 50.0, 0.01
    for k, (q, _) in enumerate(host.run(0.0, 20, h, "hip.q[1]", "hip.qd[1]")):
        t = (k + 1) * h
        assert q == pytest.approx(0.5 - 0.3 * (1 + w * t) * math.exp(-w * t), abs=1e-12)
    host.put("inputs.angle.bandwidth", 400.0)
    host.set(angle=0.6)
    assert host.run(0.2, 5, h, "hip.q[1]")[-1][0] == pytest.approx(0.6, abs=1e-6)


def test_a_motion_follows_exactly_when_the_derivatives_are_given() -> None:
    """The FMU extends a parabola without error, using two derivatives of the input."""
    host = Host(exported("arm"), angle=0.2)
    at = host.reference["angle"]
    for k in range(20):
        t = 0.02 * k
        host.set(angle=0.2 + 2 * t * t)
        host.fmu.setRealInputDerivatives([at, at], [1, 2], [4 * t, 4.0])
        host.fmu.doStep(t, 0.02)
        assert host.get("hip.q[1]")[0] == pytest.approx(0.2 + 2 * (t + 0.02) ** 2, abs=1e-13)
        assert host.get("hip.qdd[1]")[0] == pytest.approx(4.0, abs=1e-11)


def test_directional_derivatives_are_those_of_differences() -> None:
    host = Host(exported("arm"), stop=1.0)
    host.run(0.0, 13, 0.01)
    names = ("knee.qdd[1]", "hip.drive.effort[1]", "knee.reaction.force[1]", "knee.q[1]")
    unknown = [host.reference[n] for n in names]
    before = host.run(0.13, 1, 0.01, *names)
    exact = np.array(host.fmu.getDirectionalDerivative(unknown, [host.reference["motor"]], [1.0]))
    assert host.get(*names) == before[0], "asking changes nothing"
    values = []
    for sign in (1, -1):
        host.set(motor=0.5 + 1e-4 * sign)
        values.append(np.array(host.get(*names)))
    assert np.allclose(exact, (values[0] - values[1]) / 2e-4, rtol=1e-7, atol=1e-9)
    assert exact[3] == 0.0


@BOTH
def test_tunable_parameters_take_effect_at_once_and_fixed_ones_before_the_start(flavour: str) -> None:
    host = Host(exported("spherical_pendulum", flavour), begin=False)
    host.put("bodies.pendulum.mass", 10.0)
    host.put("joints.ball.start.q[1]", math.cos(0.2))
    host.put("joints.ball.start.q[3]", math.sin(0.2))
    tip = host.get("pendulum.tip.position[1]", TIP)
    assert tip == pytest.approx([math.cos(0.4), -math.sin(0.4)], abs=1e-12)
    host.fmu.exitInitializationMode()
    assert host.get("ball.contact[1].normal_force")[0] < 10 * 9.81
    host.run(0.0, 10, 0.01)
    slow = host.get("ball.friction.torque[2]")[0]
    host.put("joints.ball.friction.mu", 0.06)
    assert abs(host.get("ball.friction.torque[2]")[0]) < 0.2 * abs(slow)


def test_a_fixed_parameter_set_too_late_and_values_out_of_range_are_refused_with_words() -> None:
    host = Host(exported("spherical_pendulum"))
    mu = "joints.ball.friction.mu"
    for name, value in (("bodies.pendulum.mass", 5.0), (mu, -0.1), (mu, math.nan), (TIP, 0)):
        with pytest.raises(FMICallException):
            host.put(name, value)
    said = " ".join(text for _, text in host.log)
    for word in ("fixed", "mu must not be negative (it is -0.1)", "finite", "output"):
        assert word in said
    host.run(0.0, 3, 0.01)


@BOTH
def test_a_run_continues_when_a_refused_value_is_followed_by_a_good_one(flavour: str) -> None:
    host, same = (Host(exported("spherical_pendulum", flavour)) for _ in range(2))
    mu = "joints.ball.friction.mu"
    for h in (host, same):
        h.run(0.0, 2, 0.01)
    with pytest.raises(FMICallException) as e:
        host.put(mu, -0.1)
    assert e.value.status == 2
    assert f"{mu}: mu must not be negative (it is -0.1)" in said(host)
    for h in (host, same):
        h.put(mu, 0.2)
    assert host.run(0.02, 3, 0.01, "ball.qd[2]") == same.run(0.02, 3, 0.01, "ball.qd[2]")


@BOTH
def test_steps_of_no_length_are_refused_and_the_run_continues(flavour: str) -> None:
    host = Host(exported("spherical_pendulum", flavour))
    host.run(0.0, 1, 0.01)
    for h in (0.0, -0.01):
        with pytest.raises(FMICallException) as e:
            host.fmu.doStep(0.01, h)
        assert e.value.status == 2
    assert "positive" in said(host)
    host.run(0.01, 1, 0.01)


def test_the_stop_time_is_honoured_and_other_start_times_work() -> None:
    late, early = (Host(exported("spherical_pendulum"), start=t, stop=t + 0.1) for t in (5.0, 0.0))
    assert late.run(5.0, 10, 0.01, TIP)[-1] == pytest.approx(early.run(0.0, 10, 0.01, TIP)[-1], abs=1e-10)
    with pytest.raises(FMICallException):
        late.fmu.doStep(5.1, 0.01)
    assert "stop time" in late.log[-1][1]


def jamming() -> trunnion.Scene:
    """Example 8.3 with the guide as the paper's text literally describes it. With more friction, the guide jams from the start."""
    data = scene_to_dict(trunnion.load_scene("double_pendulum"))
    data["name"] = "jamming"
    return scene_from_dict(data)


@pytest.mark.default_cases(1)
@BOTH
def test_a_run_that_cannot_continue_is_discarded_with_its_time_and_reason(flavour: str) -> None:
    file = FOLDER / f"jamming-{flavour}.fmu"
    if not file.exists():
        export(jamming(), file, flavour=flavour, outputs=["guide.*"])
    host = Host(file)
    host.run(0.0, 5, 0.01)
    kept = host.fmu.getFMUState()
    host.put("joints.guide.friction.half_length", 0.05)
    with pytest.raises(FMICallException) as e:
        host.run(0.05, 100, 0.01)
    assert e.value.status == 2
    assert "jammed in joint guide" in said(host)
    assert host.fmu.getBooleanStatus(TERMINATED)
    assert host.fmu.getRealStatus(LAST_SUCCESSFUL_TIME) == pytest.approx(0.05)
    assert host.fmu.getStatus(DO_STEP) == 2
    host.fmu.setFMUState(kept)
    host.run(0.05, 5, 0.01)


def test_in_real_time_mode_steps_are_fixed_and_bounded() -> None:
    host = Host(exported("spherical_pendulum"), solver__step=1e-3)
    host.put("solver.max_steps", 15)
    fixed = host.run(0.0, 20, 0.01, TIP)[-1][0]
    assert fixed == pytest.approx(Host(exported("spherical_pendulum")).run(0.0, 20, 0.01, TIP)[-1][0], abs=1e-7)
    with pytest.raises(FMICallException) as e:
        host.fmu.doStep(0.2, 0.1)
    assert e.value.status == 2
    assert "solver.max_steps" in host.log[-1][1]


def test_instances_in_threads_do_not_disturb_each_other() -> None:
    file, found = exported("spherical_pendulum"), []
    hosts = [Host(file) for _ in range(4)]
    threads = [threading.Thread(target=lambda h=h: found.append(h.run(0.0, 200, 0.01, TIP)[-1])) for h in hosts]
    for t in threads:
        t.start()
    for t in threads:
        t.join()
    assert all(f == found[0] for f in found)
    assert len(found) == 4
