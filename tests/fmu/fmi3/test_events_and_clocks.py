"""FMI 3.0: every stick, slip, reversal, separation and impact is an event at its own instant. Stopping at events does not change
the run."""

from __future__ import annotations

import numpy as np
import pytest
from fmpy import read_model_description, simulate_fmu

import trunnion
from tests.default_case_selection import sampled
from tests.fmu.cosimulation.test_jams import GUIDE, through
from tests.fmu.exported_fmus import FOLDER, exported
from tests.fmu.fmi3.event_mode_host import Host3
from tests.fmu.fmpy_host import Host
from tests.fmu.model_exchange.model_exchange_host import Importer, exchange
from trunnion.fmu.scene_export import export
from trunnion.scene import model_names

SAME_TIME = 1e-8
"""Allowed difference of event times between the engine and an FMU, s; they round differently."""
BALL = ("ball.qd", "ball.qdd", "ball.friction.torque")
SOME = ("caught_carriage", "crank_slider", "double_pendulum", "spherical_pendulum", "spherical_pendulum:regularized")
"""Models with and without loops, with latches and with a law without events."""
LAWS = ("spherical_pendulum", "spherical_pendulum:regularized", "spherical_pendulum:stribeck", "double_pendulum")


def logged(model: str, until: float, h: float, skip: int = 0) -> list[tuple[float, str]]:
    """(time, clock) of the events in the log of a model's FMI 2.0 FMU, in the order of time."""
    host = Host(exported(model), logging=True)
    host.run(0.0, round(until / h) + skip, h)
    found = [text.split() for _, text in host.log if text.startswith("event at")]
    return sorted((float(w[4]), f"{w[-1]}.events.{'_'.join(w[6:-3])}") for w in found if float(w[4]) <= until)


def test_the_eleven_events_of_example_8_1_are_where_the_engine_has_them() -> None:
    """The run uses fmpy's own event mode, which makes two rows at each event."""
    expected = [e.time for e in trunnion.simulate("spherical_pendulum").events]
    assert len(expected) == 11
    got = simulate_fmu(str(exported("spherical_pendulum", fmi=3)), stop_time=10, output_interval=0.01, use_event_mode=True,
                       early_return_allowed=True)  # fmt: skip
    found = got["time"][1:][np.diff(got["time"]) == 0]
    assert found == pytest.approx(expected, abs=SAME_TIME)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("model", LAWS)
def test_each_event_is_reported_once_at_its_instant_by_the_clock_of_its_joint_and_kind(model: str) -> None:
    """The test includes reversals inside a proportional zone. The FMU records such a reversal only when the motion leaves the
    zone."""
    until, h = 5.0, 0.1
    due = logged(model, until, h, skip=10)
    events, _ = Host3(exported(model, fmi=3)).run(until, h)
    told = sorted((time, name) for time, clocks, *_ in events for name in clocks)
    assert len(told) >= 5
    assert [name for _, name in told] == [name for _, name in due]
    assert [t for t, _ in told] == pytest.approx([t for t, _ in due], abs=1e-11)  # the log prints times with these digits


def at_points(got: np.ndarray, times: np.ndarray) -> np.ndarray:
    """The last row at each of these times."""
    return np.array([np.flatnonzero(np.isclose(got["time"], t, rtol=0, atol=1e-12))[-1] for t in times])


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("model", sampled([*model_names(), "spherical_pendulum:regularized"], SOME))
def test_outputs_at_communication_points_are_those_of_fmi_2_bit_for_bit(model: str) -> None:
    until = min(float(trunnion.load_scene(model.partition(":")[0]).simulation.until), 2.0)
    common = {"stop_time": until, "output_interval": until / 40, "fmi_type": "CoSimulation"}
    two = {v.name: v for v in read_model_description(exported(model)).modelVariables if v.causality in ("output", "local")}
    three = [v for v in read_model_description(exported(model, fmi=3)).modelVariables
             if v.causality in ("output", "local") and v.type not in ("Clock", "String") and not v.clocks]  # fmt: skip
    plain = simulate_fmu(str(exported(model)), output=list(two), **common)
    names = [v.name for v in three]
    for how in ({}, {"use_event_mode": True, "early_return_allowed": True}):
        got = simulate_fmu(str(exported(model, fmi=3)), output=names, **common, **how)
        rows, compared = at_points(got, plain["time"]), 0
        for name in names:
            values = got[name][rows].astype(float).reshape(len(rows), -1)
            parts = [name] if values.shape[1] == 1 else [f"{name}[{k + 1}]" for k in range(values.shape[1])]
            assert not [p for p, x in zip(parts, values.T, strict=True) if not np.array_equal(plain[p], x)]
            compared += len(parts)
        assert compared == len(two)


def test_outputs_are_those_up_to_an_event_until_the_event_is_handled_and_then_those_just_after() -> None:
    """The acceleration jumps at a reversal. The test compares it with accelerations of the FMI 2.0 FMU slightly before and after
    the reversal."""
    (time, clocks, before, after), *_ = Host3(exported("spherical_pendulum", fmi=3)).run(1.0, 0.1, *BALL)[0]
    assert clocks == ["ball.events.reversal"]
    host, apart = Host(exported("spherical_pendulum")), 1e-6
    names = [f"{n}[{k}]" for n in BALL for k in (1, 2, 3)]
    host.run(0.0, 1, time - apart)
    earlier = host.get(*names)
    host.fmu.doStep(time - apart, 2 * apart)
    later = host.get(*names)
    # accelerations change by less than this within a microsecond
    assert before[3:] == pytest.approx(earlier[3:], rel=1e-4, abs=1e-4)
    assert after[3:] == pytest.approx(later[3:], rel=1e-4, abs=1e-4)
    assert abs(before[4] - after[4]) > 0.1


def test_a_clock_ticks_once_when_it_is_read_and_its_variables_stay() -> None:
    host = Host3(exported("spherical_pendulum", fmi=3))
    due, _, early, reached = host.step(2.0)
    assert (due, early) == (True, True)
    host.fmu.enterEventMode()
    assert host.ticking() == ["ball.events.reversal"]
    assert host.ticking() == []
    assert host.get("ball.events.reversal.time", "ball.events.reversal.count", "time") == [reached, 1, reached]
    host.fmu.updateDiscreteStates()
    assert host.get("events.last.joint_name") == ["ball"]
    host.fmu.enterStepMode()
    assert host.step(2.0)[0]
    host.handle()
    assert host.get("ball.events.reversal.count", "ball.events.stick.count") == [2, 0]


def test_where_the_host_lets_no_step_return_early_it_is_reported_at_the_communication_point() -> None:
    at = trunnion.simulate("spherical_pendulum", until=2.5).events
    host = Host3(exported("spherical_pendulum", fmi=3), early=False)
    due, ended, early, reached = host.step(2.5)
    assert (due, ended, early, reached) == (True, False, False, 2.5)
    assert host.handle()[0] == ["ball.events.reversal"]
    name = "ball.events.reversal"
    assert host.get(f"{name}.count", f"{name}.time") == pytest.approx([len(at), at[-1].time], abs=SAME_TIME)


def test_a_host_without_event_mode_gets_no_events() -> None:
    host = Host3(exported("spherical_pendulum", fmi=3), events=False)
    assert host.step(2.5) == (False, False, False, 2.5)
    assert host.get("events.count") == [2]


def test_an_impact_is_an_event_before_which_the_joint_moves_and_after_which_it_rests() -> None:
    file = FOLDER / "through-3.fmu"
    export("double_pendulum", file, overrides=through(0.22), outputs=["guide.qd*", "events.*"], fmi=3)
    events, _ = Host3(file).run(3.5, 0.1, "guide.qd[1]")
    hit = [(before[0], after[0]) for _, clocks, before, after in events if "guide.events.impact" in clocks]
    assert GUIDE
    assert hit
    assert all(abs(before) > 1e3 * abs(after) for before, after in hit)


def test_a_state_kept_at_an_event_continues_from_there() -> None:
    host = Host3(exported("spherical_pendulum", fmi=3))
    host.step(2.0)
    kept, time = host.fmu.getFMUState(), host.time
    expected = host.handle(*BALL), host.run(3.0, 0.05, *BALL)
    for state in (kept, host.fmu.deserializeFMUState(host.fmu.serializeFMUState(kept))):
        host.fmu.setFMUState(state)
        host.time = time
        assert (host.handle(*BALL), host.run(3.0, 0.05, *BALL)) == expected


@pytest.mark.parametrize("early", [True, False])
def test_inputs_that_are_set_at_every_point_act_as_in_fmi_2(early: bool) -> None:
    """The test makes steps that may end at events and steps that may not."""

    def motor(t: float) -> float:
        return 40.0 * np.sin(7.0 * t)

    two, three = Host(exported("arm")), Host3(exported("arm", fmi=3), early=early)
    h, found, events = 0.01, [], 0
    for k in range(100):
        two.put("motor", motor(k * h))
        three.put("motor", motor(k * h))
        end = (k + 1) * h
        two.fmu.doStep(k * h, end - k * h)
        while three.time < end:
            if three.step(end)[0]:
                three.handle()
                events += 1
        found.append((two.get("knee.q[1]", "knee.qdd[1]"), three.get("knee.q[1]", "knee.qdd[1]")))
    assert events >= 2
    assert [a for a, _ in found] == [b for _, b in found]


def test_an_input_that_is_changed_at_an_event_acts_from_there_on() -> None:
    host = Host3(exported("arm", fmi=3))
    assert host.step(1.0)[:3] == (True, False, True)
    host.fmu.enterEventMode()
    before = host.get("knee.qdd[1]")
    host.put("motor", 60.0)
    host.fmu.updateDiscreteStates()
    after = host.get("knee.qdd[1]")
    host.fmu.enterStepMode()
    assert abs(before[0] - after[0]) > 1.0
    host.step(host.time + 1e-7)
    assert host.get("knee.qdd[1]") == pytest.approx(after, rel=1e-3)


def test_times_at_which_loads_and_drives_break_are_known_ahead_to_the_last_bit() -> None:
    """Knots of a table are known in co-simulation and in model exchange, in both standards. After the last knot no time is
    known."""
    knots = [0.5, 0.50001, 1.0, 1.00001]
    host, found = Host3(exchange("swing", 3, "both"), begin=False), []
    host.fmu.enterInitializationMode(startTime=0.0)
    host.fmu.exitInitializationMode()
    *_, known, next_time = host.fmu.updateDiscreteStates()
    while known and len(found) < len(knots):
        found.append(next_time)
        host.fmu.enterStepMode()
        while host.time < next_time:
            host.step(next_time)
        host.fmu.enterEventMode()
        *_, known, next_time = host.fmu.updateDiscreteStates()
    assert found == knots
    importer, found = Importer(exchange("swing")), []
    for _ in knots:
        importer.fmu.enterEventMode()
        *_, known, next_time = importer.fmu.newDiscreteStates()
        found.append(next_time)
        importer.fmu.enterContinuousTimeMode()
        importer.place(next_time, importer.states())
    assert found == knots
