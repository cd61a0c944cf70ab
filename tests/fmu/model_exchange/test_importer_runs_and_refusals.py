"""Model exchange: the solver of an importer gives Trunnion's results and events. Guarantees of the FMU's calls, and refusals."""

from __future__ import annotations

import contextlib
import io
import re
import zipfile
from typing import Any

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave

import trunnion
from tests.fmu.exported_fmus import FOLDER, arm
from tests.fmu.fmi3.event_mode_host import Host3
from tests.fmu.fmpy_validation import validated
from tests.fmu.model_exchange.model_exchange_host import EVERY, Importer, engine_run, exchange, run_bdf, run_me, run_scipy, scene_of
from trunnion.basics.errors import SceneError
from trunnion.fmu.scene_export import ExportedScene, export, started
from trunnion.scene import model_names, scene_from_dict

MOTION = 1e-6
"""Allowed error of positions, rad or m, over the given time, in fmpy's CVode at 1e-8 (its BDF method loses two digits during the
run)."""
INSTANT = 2e-6
"""Allowed error of event times, s: the error of positions over the slowest sliding's deceleration."""


def claim_is_the_engine(name: str, until: float, fmi: int) -> None:
    """Check positions to MOTION. Check that the importer has the engine's events, in the engine's order, each within INSTANT."""
    scene = scene_of(name)
    made, events = engine_run(scene, until)
    positions = [n for n in made.names if ".q[" in n]
    got, told, complaints = run_me(exchange(name, fmi), until, [n if fmi == 2 else f"states.{n}" for n in positions])
    assert complaints == []
    for n, column in zip(positions, list(got.values())[1:], strict=True):
        assert np.abs(column - made[n]).max() <= MOTION, n
    assert [e[1:] for e in told] == [e[1:] for e in events]
    assert all(abs(mine[0] - its[0]) <= INSTANT for mine, its in zip(told, events, strict=True))


RUNS = [("spherical_pendulum", 10.0, 2), ("double_pendulum", 3.0, 2), ("double_pendulum", 3.0, 3)]


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(("name", "until", "fmi"), RUNS)
def test_cvode_gives_the_motion_and_the_events_of_the_engine(name: str, until: float, fmi: int) -> None:
    claim_is_the_engine(name, until, fmi)


@pytest.mark.slow
def test_a_brake_that_yields_in_a_braced_train_yields_in_an_importers_solver_too() -> None:
    """The ring's brake keeps its torque until the sun's bearing reaches its capacity. Then brake and bearing slide."""
    claim_is_the_engine("planets", 0.25, 2)


def test_another_solver_with_another_search_for_roots_gives_the_motion_too() -> None:
    """8.3 over 5 s in SciPy's DOP853 at 1e-11. (At 1e-8, its error is 9e-6. The errors of CVode and of the engine's rk8 are
    4e-6.)"""
    made, events = engine_run(scene_of("double_pendulum"), 5.0)
    host, names = Importer(exchange("double_pendulum")), [n for n in made.names if ".q[" in n]
    got = run_scipy(host, 5.0, 1e-11, names)
    assert np.abs(got - [made[n] for n in names]).max() <= 0.1 * MOTION
    assert host.fmu.getInteger([host.reference["events.count"]])[0] == len({t for t, _, _ in events})


def test_a_loop_closed_by_the_drift_that_is_allowed_has_the_motion_and_the_events_of_the_engine() -> None:
    """The coordinates of 8.2 that close its loop are states. Outputs follow from the closed loop."""
    claim_is_the_engine("crank_slider", 2.0, 2)


def test_a_multi_step_solver_that_starts_anew_where_a_loop_is_closed_seldom_has_to() -> None:
    """If a loop were closed after a drift of one tolerance, every third step of PyFMI's CVode would start anew and lose three
    digits."""
    host, made = Importer(exchange("spatial_slider_crank")), trunnion.simulate("spatial_slider_crank", until=0.5, rtol=1e-9)
    steps, events = run_bdf(host, 0.5, 1e-6)
    assert steps > 100
    assert events < 0.02 * steps
    angle = host.fmu.getReal([host.reference["crank_pivot.q[1]"]])[0]
    assert angle == pytest.approx(made["crank_pivot.q[1]"][-1], abs=3e-4)


def three_balls() -> trunnion.Scene:
    """Two balls and a cross between them, all with friction. The lower ball reaches its cone, where its friction jumps."""
    sizes = [(0.564, 0.026), (0.631, 0.041), (0.463, 0.028)]
    bodies = {f"b{k}": {"box": [length, 0.06, 0.05], "density": 7800, "points": {"a": [-0.15, 0, 0], "e": [0.15, up, 0]}}
              for k, (length, up) in enumerate(sizes)}
    cross = {"mu": 0.122, "radius": 0.024, "mu_static": 0.159, "half_length": 0.231}
    return scene_from_dict({
        "name": "three_balls", "gravity": [0, 0, -9.81], "bodies": bodies,
        "joints": {
            "j0": {"type": "spherical", "inboard": "ground", "outboard": "b0.a", "friction": {"mu": 0.285, "radius": 0.018},
                   "start": {"q": [1, 0, 0, 0], "qd": [1.479, 0.091, -0.788]}},
            "j1": {"type": "universal", "axis": "y", "reference": "z", "inboard": "b0.e", "outboard": "b1.a", "friction": cross,
                   "start": {"q": [0, 0], "qd": [1.284, -0.349]}},
            "j2": {"type": "spherical", "inboard": "b1.e", "outboard": "b2.a", "friction": {"mu": 0.333, "radius": 0.031},
                   "start": {"q": [1, 0, 0, 0], "qd": [0.206, 1.317, 1.588]}},
        },
        "simulation": {"until": 2, "every": EVERY},
    })  # fmt: skip


@pytest.mark.slow
def test_a_ball_comes_to_its_cone_where_its_number_is_round_off_and_where_its_friction_jumps_across() -> None:
    """Round-off decides the sign of the indicator at the point from which the run continues: at 0.505 s in CVode at 1e-8, and at
    0.869 s at 1e-10."""
    scene, file = three_balls(), FOLDER / "three-balls.fmu"
    export(scene, file, kind="me", kernel="parts")
    made = trunnion.simulate(scene, until=1.0, every=EVERY, rtol=1e-11, kernel="parts")
    for until, tolerance, far in ((0.6, 1e-8, MOTION), (1.0, 1e-10, 0.1 * MOTION)):
        names = [f"j{k}.q[{i}]" for k, i in ((0, 1), (0, 2), (1, 1), (1, 2), (2, 1), (2, 2))]
        got, _, complaints = run_me(file, until, names, relative_tolerance=tolerance)
        assert complaints == []
        assert max(np.abs(got[n] - made[n][: len(got[n])]).max() for n in names) <= far


def test_latches_fall_catch_and_let_go_at_the_engines_instants() -> None:
    """The hooks of the latches are discrete states. They fall and lift only in event mode."""
    claim_is_the_engine("thrown", 4.0, 3)


def test_friction_begins_where_a_drive_starts_from_rest() -> None:
    """In a mechanism without loops, no state shows that a driven pair moves."""
    claim_is_the_engine("driven", 0.9, 2)


def test_stops_times_of_events_and_inputs_are_the_engines() -> None:
    """The stiffness of the stops amplifies errors. The errors fall with the solver's tolerance."""
    made, events = engine_run(scene_of("swing"), 2.4)
    got, told, _ = run_me(exchange("swing"), 2.4, ["hip.q[1]", "knee.q[1]"], relative_tolerance=1e-10)
    assert {e[1] for e in events} == {"slip", "stick", "end_stop_engaged", "end_stop_released"}
    assert [e[1:] for e in told] == [e[1:] for e in events]
    assert max(np.abs(got[n] - made[n]).max() for n in ("hip.q[1]", "knee.q[1]")) <= MOTION


def described(name: str) -> list[tuple[bytes, bytes]]:
    """Descriptions of a scene for FMI 2.0 and FMI 3.0, for both kinds of use. Each description is alone in an archive."""
    model, first = started(scene_of(name), None, "auto")
    out = []
    for standard in ("2.0", "3.0"):
        box = io.BytesIO()
        with zipfile.ZipFile(box, "w") as z:
            z.writestr("modelDescription.xml", ExportedScene(model, first, 0.0, True, standard, "both").described("{}", "native"))
        out.append(box.getvalue())
    return out


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("name", [*model_names(), "swing"])
def test_fmpy_finds_no_problem_in_any_bundled_model(name: str) -> None:
    assert [validated(io.BytesIO(d)) for d in described(name)] == [[], []]


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("name", ["a b", "joints.1", "der(a", "a[1,]"])
def test_a_name_of_another_form_is_a_problem_that_fmpy_finds(name: str) -> None:
    """The invalid name follows any number of legal names; each form of these names is parsed once."""
    with zipfile.ZipFile(io.BytesIO(described("swing")[0])) as z:
        text = z.read("modelDescription.xml").decode()
    first = re.search(r'<ScalarVariable name="([^"]+)"', text)
    assert first is not None
    box = io.BytesIO()
    with zipfile.ZipFile(box, "w") as z:
        z.writestr("modelDescription.xml", text.replace(f'name="{first[1]}"', f'name="{name}"'))
    assert any("not a legal variable name" in problem for problem in validated(box))


def test_derivatives_and_indicators_are_functions_of_time_and_state() -> None:
    """Other calls in between do not change the numbers, except by round-off of the iteration for friction."""
    host = Importer(exchange("double_pendulum"))
    x = host.states()
    told = host.rates(), host.indicators()
    for k in range(5):
        host.place(0.01 * k, x + 0.1 * np.sin(np.arange(len(x)) + k))
        host.rates()
    host.place(0.0, x)
    assert host.rates() == pytest.approx(told[0], rel=1e-12, abs=1e-12)
    assert host.indicators() == pytest.approx(told[1], rel=1e-12, abs=1e-12)


def test_a_state_that_is_restored_continues_with_the_same_bits() -> None:
    host = Importer(exchange("double_pendulum"))
    t = host.euler(0.0, 1e-3, 420)
    kept = host.fmu.getFMUstate()
    host.euler(t, 1e-3, 200)
    first = host.states()
    host.fmu.setFMUstate(kept)
    host.euler(t, 1e-3, 200)
    assert np.array_equal(host.states(), first)


def test_no_indicator_is_zero_after_an_event_and_an_importer_without_root_finding_sees_the_same_events() -> None:
    """With Euler's method, the first events are the engine's events, each at the end of a step."""
    host, h = Importer(exchange("double_pendulum")), 1e-4
    _, events = engine_run(scene_of("double_pendulum"), 1.0)
    for k in range(int(0.9 / h)):
        host.euler(k * h, h, 1)
        assert np.all(host.indicators() != 0.0)
    count = host.fmu.getInteger([host.reference["events.count"]])[0]
    assert count == len({t for t, _, _ in events if t < 0.9})


def test_a_jam_is_an_error_in_the_words_of_the_engine() -> None:
    changes = (("joints.guide.friction.half_length", 0.22),)
    log: list[tuple[int, str]] = []
    outcome = trunnion.simulate(scene_of("double_pendulum", changes), until=5.0, rtol=1e-11).outcome
    with pytest.raises(FMICallException) as failed:
        run_me(exchange("double_pendulum", 2, "me", changes), 5.0, ["guide.q[1]"], log)
    assert failed.value.status == 3
    mine, its = (re.sub(r"t = \S+ s", "t", text) for text in (log[-1][1], str(outcome)))
    assert mine == its
    assert "jammed in joint guide" in its


def test_a_model_exchange_fmu_refuses_co_simulation_and_calls_out_of_their_mode() -> None:
    host = Importer(exchange("double_pendulum"))
    slave = FMU2Slave(guid=host.md.guid, unzipDirectory=host.folder, instanceName="i", modelIdentifier="double_pendulum")
    with contextlib.suppress(Exception):
        slave.instantiate(callbacks=host.calls)
    for call in (host.fmu.newDiscreteStates, lambda: host.fmu.setReal([host.reference["joints.guide.friction.mu"]], [0.2])):
        with pytest.raises(FMICallException):
            call()
    said = [text.split(":")[0] for text in host.log]
    assert said == ["this FMU is only for model exchange", "UpdateDiscreteStates", "joints.guide.friction.mu"]


def test_states_can_be_read_in_co_simulation_where_an_fmu_is_for_both() -> None:
    host = Host3(exchange("spherical_pendulum", 3, "both"))
    host.fmu.doStep(0.0, EVERY)
    its = host.get("ball.q")[:1] + host.get("ball.qd")[1:2]
    assert host.get("states.ball.q[1]", "states.ball.qd[2]") == pytest.approx(its, abs=1e-12)
    assert host.get("der(states.ball.qd[2])") == pytest.approx(host.get("ball.qdd")[1:2], abs=1e-9)


@pytest.mark.parametrize(
    ("scene", "how", "places"),
    [
        (arm, {}, {"inputs.angle"}),
        (arm, {"overrides": {"simulation.jams": "impact", "simulation.method": "moreau"}},
         {"inputs.angle", "simulation.jams", "simulation.method"}),
        (arm, {"flavour": "python", "step": 1e-3}, {"--flavour", "--step"}),
        (arm, {"kind": "model"}, {"--type"}),
    ],
)  # fmt: skip
def test_options_that_model_exchange_cannot_follow_are_refused_with_remedies(scene: Any, how: dict, places: set[str]) -> None:
    with pytest.raises(SceneError) as refused:
        export(scene(), FOLDER / "never.fmu", **{"kind": "me", **how})
    assert {p.where for p in refused.value.problems} == places
    assert all(p.hint for p in refused.value.problems)
