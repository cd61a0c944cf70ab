"""Tables as curves: runs compared with SciPy's interpolation, ends at rest, statics at the run's position, long tables."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline, PchipInterpolator

import trunnion
from trunnion.analysis.static_bounds.start_pose_statics import hold
from trunnion.cli import main
from trunnion.scene import scene_from_dict
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.file_format.yaml_writer import scene_to_yaml
from trunnion.scene.overrides import list_parameters
from trunnion.simulation.run import Model, simulate
from trunnion.system.signals.signal_tables import curve

TIME, VALUE = (0.0, 0.5, 0.8, 1.3, 2.0), (0.0, 0.0, 0.6, 0.5, 1.1)
RATES = (0.3, -0.2)
WAYS = {
    "natural": ({"interpolation": "natural"}, CubicSpline(TIME, VALUE, bc_type="natural")),
    "clamped": ({"interpolation": "clamped"}, CubicSpline(TIME, VALUE, bc_type="clamped")),
    "clamped to rates": (
        {"interpolation": "clamped", "end_rates": RATES}, CubicSpline(TIME, VALUE, bc_type=((1, RATES[0]), (1, RATES[1])))),
    "monotone": ({"interpolation": "monotone"}, PchipInterpolator(TIME, VALUE)),
}  # fmt: skip
LINK = {"box": [0.3, 0.1, 0.1], "mass": 2.0, "points": {"a": [-0.15, 0, 0]}}


def table(shift: float = 0.0, **more: object) -> dict:
    return {"time": [t + shift for t in TIME], "value": list(VALUE), **more}


def driven(drive: dict, **more: object) -> sm.Scene:
    """A scene of one link that a drive turns. Gravity acts across the axis."""
    joint = {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "link.a", "drive": drive}
    bodies = {"link": LINK}
    given = {"schema": 1, "name": "driven", "gravity": [0, -9.81, 0], "bodies": bodies, "joints": {"j": joint}}
    return scene_from_dict(given | more)


def pushed(load: dict) -> sm.Scene:
    """A mass of 2 kg on a rail without gravity, under a force. Its acceleration shows the force."""
    joint = {"type": "prismatic", "axis": "x", "inboard": "ground", "outboard": "m", "effort": {"table": load}}
    bodies = {"m": {"mass": 2.0, "inertia": [1, 1, 1]}}
    return scene_from_dict({"schema": 1, "name": "pushed", "gravity": [0, 0, 0], "bodies": bodies, "joints": {"j": joint}})


@pytest.mark.parametrize("way", WAYS)
def test_a_drive_is_what_scipy_interpolates_and_goes_straight_on_beyond(way: str) -> None:
    fields, exact = WAYS[way]
    r = simulate(driven({"table": table(**fields, shift=0.3)}), until=3.0, every=0.0037, rtol=1e-10)
    t = r.time - 0.3
    inside = np.clip(t, TIME[0], TIME[-1])
    away = np.abs(np.subtract.outer(t, TIME)).min(axis=1) > 1e-9
    assert r["j.q[1]"] == pytest.approx(exact(inside) + exact(inside, 1) * (t - inside), abs=1e-13)
    assert r["j.qd[1]"] == pytest.approx(exact(inside, 1), abs=1e-12)
    assert r["j.qdd[1]"][away] == pytest.approx(np.where(t == inside, exact(inside, 2), 0.0)[away], abs=1e-10)


@pytest.mark.parametrize("way", WAYS)
def test_a_load_may_be_smooth_and_keeps_its_value_beyond(way: str) -> None:
    fields, exact = WAYS[way]
    r = simulate(pushed(table(**fields)), until=2.5, every=0.01, rtol=1e-10)
    assert 2.0 * r["j.qdd[1]"] == pytest.approx(exact(np.clip(r.time, TIME[0], TIME[-1])), abs=1e-13)


def test_by_default_loads_are_straight_lines_and_drives_natural_splines() -> None:
    r = simulate(pushed(table()), until=2.5, every=0.01, rtol=1e-10)
    assert 2.0 * r["j.qdd[1]"] == pytest.approx(np.interp(r.time, TIME, VALUE), abs=1e-13)
    said = curve(sm.Table(TIME, VALUE, interpolation="natural"), True)
    assert np.array_equal(curve(sm.Table(TIME, VALUE), True).record(), said.record())


@pytest.mark.parametrize(("way", "rests"), [("natural", False), ("clamped", True), ("monotone", True)])
def test_data_that_start_flat_start_at_rest_where_the_curve_is_made_for_it(way: str, rests: bool) -> None:
    """Clamped and monotone interpolation start at rest. The natural spline does not start at rest, and a note reports this."""
    r = simulate(driven({"table": table(interpolation=way)}), until=0.1)
    assert r["j.qd[1]"][0] == pytest.approx(float(WAYS[way][1](0.0, 1)), abs=1e-15)
    assert (abs(r["j.qd[1]"][0]) < 1e-15) == rests
    assert any("table starts at" in n and "two values are equal" in n for n in r.notes) == (not rests)


def test_a_monotone_drive_rests_where_its_values_rest() -> None:
    r = simulate(driven({"table": table(interpolation="monotone")}), until=2.0, every=0.01)
    assert np.abs(r["j.q[1]"][r.time < 0.5]).max() <= 1e-15
    assert r["j.q[1]"].max() <= max(VALUE) + 1e-15


def test_check_reports_the_rate_a_table_begins_with(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "driven.yaml"
    for values, told in (((0.1, 0.3, 0.2), True), ((0.1, 0.1, 0.2), True), ((0.2, 0.2, 0.2), False)):
        file.write_text(scene_to_yaml(driven({"table": {"time": [0.0, 1.0, 2.0], "value": list(values)}})))
        assert main(["check", str(file)]) == 0
        said = capsys.readouterr().out
        assert ("table starts at" in said) == told
        assert said.count("table starts at") <= 1
        rate = float(CubicSpline([0.0, 1.0, 2.0], values, bc_type="natural")(0.0, 1))
        assert (f"{rate:.4g} rad/s" in said) == told


DRIVES = {
    "table": {"table": {"time": [-0.4, 0.6, 1.0, 2.0], "value": [0.0, 2.0, 0.3, 0.5]}},
    "monotone table": {"table": {"time": [-0.4, 0.6, 1.0], "value": [0.0, 2.0, 0.3], "interpolation": "monotone"}},
    "late table": {"table": {"time": [0.6, 1.0, 2.0], "value": [2.0, 0.3, 0.5]}},
    "ramp": {"ramp": {"start": 1.0, "end": 2.0, "duration": 0.5, "origin": 0.7}},
    "begun ramp": {"ramp": {"start": 1.0, "end": 2.0, "duration": 0.5, "begin": -0.2, "origin": 0.7}},
    "harmonic": {"harmonic": {"amplitude": 0.4, "frequency": 2.0, "phase": 0.5, "offset": 0.3}},
    "constant": {"constant": {"rate": 1.0, "start": 0.6}},
    "input": {"input": "angle"},
}


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("what", DRIVES)
def test_statics_hold_a_drive_where_the_run_has_it(what: str) -> None:
    """The friction share of a pendulum on a driven link depends on the link's angle. The pendulum's shoe hangs on a rail along the
    link, with friction 1. The share is |tan(angle)|, because no moment acts: the shoe is at the mass centre."""
    inputs = {"inputs": {"angle": {"unit": "rad", "start": 0.35}}}
    scene = driven(DRIVES[what], **inputs)
    shoe = {"mass": 1.0, "inertia": [1e-9, 1e-9, 1e-9]}
    rail = sm.Joint("prismatic", "link.a", "shoe", axis="x", reference="y",
                    friction=sm.Friction(mu=1.0, half_length=10.0, half_width=1e-6, half_height=1e-6))  # fmt: skip
    whole = sm.Scene(
        {**scene.bodies, "shoe": sm.Body(**{k: tuple(v) if isinstance(v, list) else v for k, v in shoe.items()})},
        {**scene.joints, "rail": rail}, gravity=scene.gravity, inputs=scene.inputs, friction=sm.FrictionDefaults(law="coulomb"),
    )  # fmt: skip
    at = simulate(whole, until=1e-6)["j.q[1]"][0]
    (pair,) = hold(whole).pairs
    assert at != 0.0
    assert pair.share == pytest.approx(abs(np.tan(at)), rel=1e-5)  # the sleeve's thickness is small, but not zero


def test_a_ramp_that_begins_before_the_run_starts_at_its_origin() -> None:
    r = simulate(driven(DRIVES["begun ramp"]), until=1.0, every=0.1)
    assert r["j.q[1]"][0] == 0.7
    assert r["j.q[1]"][-1] == pytest.approx(0.7 + 0.5 * (1.4 + 2.0) * 0.3 + 2.0 * 0.7, abs=1e-14)


def test_twenty_thousand_samples_need_no_square_matrix() -> None:
    """A dense matrix of this order takes 3.2 GB; the banded matrix takes a megabyte."""
    t = np.linspace(0.0, 20.0, 20_000)
    given = sm.Table(tuple(t.tolist()), tuple(np.sin(t).tolist()), interpolation="clamped", end_rates=(1.0, float(np.cos(20.0))))
    tracemalloc.start()
    found = curve(given, True)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 100e6
    assert found.shape == pytest.approx(-np.sin(t), abs=1e-6)  # the error of a spline's second derivative is of order h²


def test_a_run_follows_twenty_thousand_samples() -> None:
    t = np.linspace(0.0, 20.0, 20_000)
    drive = {"table": {"time": t.tolist(), "value": np.sin(t).tolist(), "interpolation": "clamped", "end_rates": [1.0, 0.408]}}
    r = simulate(driven(drive), until=0.5, every=0.0501)
    assert r["j.q[1]"] == pytest.approx(np.sin(r.time), abs=1e-12)


@pytest.mark.parametrize(
    ("fields", "said"),
    [({"interpolation": "linear"}, "rate would jump"), ({"end_rates": [0, 0]}, "clamped"), ({"interpolation": "cubic"}, "natural"),
     ({"interpolation": "clamped", "end_rates": ["1 m/s", 0]}, "angular velocity")],
)  # fmt: skip
def test_a_table_that_a_drive_cannot_follow_is_refused(fields: dict, said: str) -> None:
    with pytest.raises(trunnion.SceneError, match=said):
        driven({"table": table(**fields)})


def test_end_rates_are_rates_of_what_the_table_gives() -> None:
    scene = pushed(table(interpolation="clamped", end_rates=["1 kN/s", 0]))
    found = {p.path: (p.value, p.unit) for p in list_parameters(scene)}
    assert found["joints.j.effort.table.end_rates[1]"] == (1000.0, "N/s")
    turned = driven({"table": table(interpolation="clamped", end_rates=["90 deg/s", 0])})
    assert {p.path: p.unit for p in list_parameters(turned)}["joints.j.drive.table.end_rates[1]"] == "rad/s"


def test_cases_with_other_ends_do_not_share_a_table() -> None:
    scene = driven({"table": table(interpolation="clamped", end_rates=[0.0, 0.0])})
    s = trunnion.sweep(scene, {"joints.j.drive.table.end_rates[1]": [0.0, 0.5, 1.0]}, reductions=["final:j.q[1]"], until=0.3)
    exact = [float(CubicSpline(TIME, VALUE, bc_type=((1, r), (1, 0.0)))(0.3)) for r in (0.0, 0.5, 1.0)]
    assert s.table.column("final:j.q[1]").to_pylist() == pytest.approx(exact, abs=1e-12)


def test_signals_of_a_block_are_those_of_its_tables() -> None:
    """Sensitivities evaluate the signals of a block, also at times beyond the run."""
    model = Model(driven({"table": table(interpolation="clamped")}))
    exact = WAYS["clamped"][1]
    x = np.zeros(model.system.external.size)
    for t in (0.1, 0.77, 1.9):
        x[1] = t
        model.block.signals(t, x)
        assert x[0] == t
        assert x[2:6] == pytest.approx([float(exact(t, d)) for d in range(4)], rel=1e-12)
