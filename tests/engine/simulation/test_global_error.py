"""Stated errors are compared with closed forms and with far tighter runs. A run that cannot state errors says so and gives the
reason."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

from trunnion.basics.errors import SceneError
from trunnion.scene import models_dir
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.execution.runnable_model import Model
from trunnion.simulation.global_error.column_error_kinds import differences, kinds
from trunnion.simulation.global_error.event_pairs import pair_events
from trunnion.simulation.results.csv_and_parquet import load_result_table
from trunnion.simulation.results.error_statement import Certainty
from trunnion.simulation.results.event import Event
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate

G = 9.81
LOW, HIGH = 0.2, 5.0
"""Limits of stated over true error. A lower ratio breaks the promise; a higher ratio gives little information."""
METHODS = ("rk5", "rk8", "rosenbrock")


def certain(r: Result) -> Certainty:
    """The stated errors of a certified run."""
    assert r.certainty is not None
    return r.certainty


def so_far(error: np.ndarray) -> np.ndarray:
    """The largest error of all rows up to each row."""
    return np.maximum.accumulate(np.abs(error))


@pytest.mark.default_cases(8)
@pytest.mark.parametrize("rtol", [1e-4, 1e-7, 1e-10])
@pytest.mark.parametrize("method", METHODS)
def test_the_stated_error_of_a_pendulum_is_that_from_its_closed_form(method: str, rtol: float) -> None:
    r = simulate("simple_pendulum", until=10.0, every=0.05, rtol=rtol, method=method, outputs="bob.position*", certify=True)
    w, m = math.sqrt(G), 0.5
    angle = 2 * np.arcsin(math.sqrt(m) * ellipj(ellipk(m) - w * r.time, m)[0])
    c = certain(r)
    assert c.promise.whole
    for name, exact in (("bob.position[1]", -np.sin(angle)), ("bob.position[2]", -np.cos(angle))):
        true = so_far(r[name] - exact)
        counts = true > 10.0 * c.floor[c.names.index(name)]
        assert counts.sum() > 100
        ratio = c[name][counts] / true[counts]
        assert ratio.min() > LOW
        assert np.mean((ratio >= 0.5) & (ratio <= HIGH)) > 0.95


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("scene", ["spherical_pendulum", "crank_slider"])
@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8])
def test_events_rest_and_columns_that_jump_are_covered_by_their_errors(scene: str, rtol: float) -> None:
    r, exact = simulate(scene, rtol=rtol, certify=True), simulate(scene, rtol=1e-13)
    c = certain(r)
    assert c.promise.whole
    same = pair_events(r.events, exact.events, math.inf)
    assert math.isinf(same.alone)
    for i, (mine, other) in same.times.items():
        assert abs(mine - other) <= c.event_errors[i]
    at_once = dict(zip((e.time for e in r.events), c.event_errors, strict=True))
    assert all(at_once[e.time] == x for e, x in zip(r.events, c.event_errors, strict=True))
    k = kinds(r.columns, Model(r.scene, [x.name for x in r.columns]).built.numbers)
    true = differences(r.data[:, 1:], exact.data[:, 1:], k)
    true[np.ix_(c.shift > 0.0, k.jumps)] = 0.0
    counts = (np.maximum.accumulate(true) > 10.0 * c.floor) & k.errs
    assert np.mean(c.error[counts] >= np.maximum.accumulate(true)[counts]) > 0.9
    assert np.min(c.error[counts] / np.maximum.accumulate(true)[counts]) > LOW
    last = [i for i, x in enumerate(r.columns) if x.quantity.name in ("position", "q")]
    assert np.all(true[-1, last] <= c.error[-1, last])


def test_a_block_that_slides_to_rest_is_within_its_error_of_the_closed_form() -> None:
    drag, v, mass = 6.0, 2.0, 2.0
    friction = sm.Friction(force=drag, law="coulomb")
    joint = sm.Joint("prismatic", "ground", "block", axis="x", friction=friction, start=sm.Start(qd=v))
    scene = sm.Scene({"block": sm.Body(mass=mass, inertia=(0.1, 0.1, 0.1))}, {"slide": joint}, gravity=(0.0, 0.0, 0.0))
    r = simulate(scene, until=1.0, certify=True)
    c, stop = certain(r), mass * v / drag
    place = [e.kind for e in r.events].index("stick")
    assert abs(r.events[place].time - stop) <= c.event_errors[place] < 1e-7
    assert abs(r["slide.q[1]"][-1] - v * stop / 2) <= c["slide.q[1]"][-1] < 1e-7


def rods(until: float) -> Result:
    """Two rods without friction that fall from far above; their motion is chaotic."""
    rod = sm.Body(box=(1.0, 0.05, 0.05), density=1000.0, points={"a": (-0.5, 0, 0), "b": (0.5, 0, 0)})
    joints = {
        "one": sm.Joint("revolute", "ground", "first.a", axis="z", start=sm.Start(q=2.0)),
        "two": sm.Joint("revolute", "first.b", "second.a", axis="z", start=sm.Start(q=1.0)),
    }
    scene = sm.Scene({"first": rod, "second": rod}, joints, "rods", gravity=(0, -G, 0))
    return simulate(scene, until=until, every=0.02, certify=True, outputs="*.q*")


def test_chaos_loses_its_promise_by_name_and_keeps_it_until_then() -> None:
    r = rods(40.0)
    c = certain(r)
    assert (c.promise.why, c.promise.whole) == ("growth", False)
    assert 2.0 < c.promise.until < 40.0
    assert 0.1 < c.promise.doubling < 2.0
    assert any("no error is stated from" in n and "doubled every" in n for n in r.notes)
    kept = r.time < c.promise.until
    assert np.isfinite(c["one.q[1]"][kept]).all()
    assert np.isnan(c["one.q[1]"][~kept]).all()
    exact = simulate(r.scene, until=40.0, every=0.02, rtol=1e-13, outputs="*.q*")
    true = so_far(r["two.q[1]"] - exact["two.q[1]"])[kept]
    assert np.all(c["two.q[1]"][kept][50:] > LOW * true[50:])
    assert certain(rods(2.0)).promise.whole


def test_a_decision_that_the_error_overturns_ends_the_promise() -> None:
    """The block stops where spring force and static friction differ by one part in a million."""
    scene = models_dir() / "stability" / "25_marginal.yaml"
    loose, tight = (certain(simulate(scene, rtol=rtol, certify=True)).promise for rtol in (1e-6, 1e-9))
    assert (loose.why, loose.about) == ("marginal", "reversal of slide")
    assert loose.until == pytest.approx(0.2, abs=0.01)
    assert tight.whole


def test_an_event_that_one_run_has_alone_is_found_where_it_is() -> None:
    def at(*times: float) -> list[Event]:
        return [Event(t, "stick", "a") for t in times]

    pairs = pair_events(at(1.0, 2.0, 3.0), at(1.1, 3.1), math.inf)
    assert pairs.times == {0: (1.0, 1.1), 2: (3.0, 3.1)}
    assert (pairs.alone, pairs.about) == (2.0, "stick of a in this run only")
    assert pair_events(at(1.1, 3.1), at(1.0, 2.0, 3.0), math.inf).about == "stick of a in the tighter run only"
    assert math.isinf(pair_events(at(1.0), at(1.0, 4.99), near_end=4.9).alone)
    told = [Event(0.5, kind, "a") for kind in ("separation", "contact_jump")]  # these events do not affect the motion
    assert math.isinf(pair_events(told, [], math.inf).alone)


def test_a_run_with_fixed_steps_states_its_error() -> None:
    r = simulate("simple_pendulum", until=2.0, every=0.05, step=0.05, method="rk5", outputs="bob.position*", certify=True)
    angle = 2 * np.arcsin(math.sqrt(0.5) * ellipj(ellipk(0.5) - math.sqrt(G) * r.time, 0.5)[0])
    true, stated = so_far(r["bob.position[1]"] + np.sin(angle)), certain(r)["bob.position[1]"]
    assert np.all(stated[5:] > 0.5 * true[5:])
    assert stated[-1] < HIGH * true[-1]


def test_certification_does_not_change_the_run_and_shows_only_requested_columns() -> None:
    given = {"until": 2.0, "every": 0.01, "outputs": ["ball.friction*", "energy.kinetic"]}
    plain, r = simulate("spherical_pendulum", **given), simulate("spherical_pendulum", certify=True, **given)  # type: ignore[arg-type]
    assert plain.certainty is None
    assert np.array_equal(plain.data, r.data)
    assert (plain.names, plain.events) == (r.names, r.events)
    assert certain(r).names == tuple(r.names[1:])
    assert certain(r).cost < 2.5


def test_errors_stand_beside_their_columns_in_tables(tmp_path: Path) -> None:
    r = simulate("spherical_pendulum", until=1.0, every=0.05, outputs=["ball.qd[2]", "audit.verdict"], certify=True)
    table = load_result_table(r.save(tmp_path / "r.csv"))
    assert table.names == ("time", "ball.qd[2]", "audit.verdict", "time.error", "ball.qd[2].error")
    assert table.units["ball.qd[2].error"] == "rad/s"
    assert np.array_equal(table["ball.qd[2].error"], certain(r)["ball.qd[2]"])
    assert table.metadata["certainty"]["promise"]["why"] == ""
    assert table.metadata["certainty"]["event_errors"] == list(certain(r).event_errors)


def test_errors_are_differences_by_the_shorter_way_and_up_to_the_sign_of_quaternions() -> None:
    model = Model(simulate("spherical_pendulum", until=0.1).scene, ["ball.q*", "ball.contact[1].angle"])
    k = kinds(model.columns, model.built.numbers)
    a = np.zeros((1, len(model.columns)))
    places = [i for i, c in enumerate(model.columns) if c.quantity.name == "q"]
    a[0, places] = 0.5
    b = a * -1.0
    a[0, k.wraps], b[0, k.wraps] = 0.1, 2 * math.pi - 0.1
    found = differences(a, b, k)[0]
    assert np.all(found[places] == 0.0)
    assert found[k.wraps] == pytest.approx(0.2)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("asked", [1e-3, "1e-6 m", 1e-9, "1 mN"])
def test_an_accuracy_asked_for_is_met_by_the_true_error(asked: str | float) -> None:
    r = simulate("spherical_pendulum", accuracy=asked, every=0.01)
    exact = simulate("spherical_pendulum", rtol=1e-13, every=0.01)
    c, (unit, most) = certain(r), {1e-3: ("m", 1e-3), "1e-6 m": ("m", 1e-6), 1e-9: ("m", 1e-9), "1 mN": ("N", 1e-3)}[asked]
    assert c.met
    quiet = c.shift == 0.0
    for name in (n for n, u in r.units.items() if u == unit):
        assert np.abs(r[name] - exact[name])[quiet].max() <= most
    assert c.document()["accuracy"] == {"asked": f"{asked:g}" if isinstance(asked, float) else asked, "met": True}


def test_an_accuracy_that_is_met_by_far_costs_no_tight_run() -> None:
    """The drive prescribes the motion of a press, so positions are exact at any tolerance."""
    r, exact = (
        simulate("toggle_press", every=0.01, outputs="*.position[*]", **k) for k in ({"accuracy": "1e-9 m"}, {"rtol": 1e-12})
    )
    tight = simulate("toggle_press", every=0.01, outputs="*.position[*]", rtol=1e-10)
    assert certain(r).met
    assert max(np.abs(r[n] - exact[n]).max() for n in r.names) <= 1e-9
    assert r.settings["rtol"] > 1e-10
    assert r.stats.rhs_evaluations < tight.stats.rhs_evaluations / 4


@pytest.mark.slow
def test_ctrl_c_in_the_tighter_run_keeps_the_run_and_promises_up_to_there(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter(float(t) for t in range(10**6))
    monkeypatch.setattr("time.perf_counter", lambda: next(clock))

    def progress(time: float, until: float) -> None:
        if time > 0.7 * until:
            raise KeyboardInterrupt

    r = simulate("crank_slider", until=1000.0, every=1.0, outputs="slider.*", certify=True, progress=progress)
    p = certain(r).promise
    assert r.outcome.ok
    assert len(r) == 1001
    assert p.why == "cancelled"
    assert 100.0 < p.until < 1000.0
    assert np.isfinite(certain(r)["slider.position[1]"][r.time < p.until]).all()


def test_nothing_is_stated_of_a_run_that_cannot_start() -> None:
    r = simulate(models_dir() / "stability" / "07_painleve.yaml", certify=True)
    assert not r.outcome.ok
    assert certain(r).promise.why == "start"
    assert np.isnan(certain(r).error).all()


def test_an_accuracy_that_cannot_be_met_is_named() -> None:
    r = simulate("spherical_pendulum", until=1.0, every=0.1, accuracy="1e-20 m")
    assert not certain(r).met
    assert any(n.startswith("the accuracy of 1e-20 m is not met: errors reach") for n in r.notes)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"accuracy": 1e-6, "rtol": 1e-6, "every": 0}, ["every", "accuracy"]),
        ({"accuracy": "1e-6 K"}, ["accuracy"]),
        ({"accuracy": "1e-6 kg"}, ["accuracy"]),
        ({"accuracy": -1.0}, ["accuracy"]),
        ({"certify": True, "every": 0}, ["every"]),
    ],
)
def test_settings_that_prevent_certification_are_refused_with_all_reasons(given: dict, told: list[str]) -> None:
    with pytest.raises(SceneError) as e:
        simulate("spherical_pendulum", **given)
    assert [p.where for p in e.value.problems] == told
