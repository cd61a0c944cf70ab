"""Wear is k ∫ N |v| dt, compared with friction's own work and with closed forms. The wear of all bins around the pin sums to the
total wear."""

from __future__ import annotations

import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from tests.engine.checks.turned_mirrored_scaled_scenes import image, scaled
from tests.reference.mechanics.rotation import random_rotation
from tests.reference.scenes.random_device_scenes import crossed
from trunnion import SceneError, load_scene, simulate, wear
from trunnion.analysis.mechanics.wear import BINS, integral
from trunnion.cli import main
from trunnion.scene.data_classes import scene as sm

K = 1e-15
GRAVITY = 9.81


def block(length: float = 0.05) -> sm.Scene:
    """A block that a steady drive moves along a rail. Its weight presses it on the rail."""
    rub = sm.Friction(mu=0.2, half_length=length, half_width=0.02, half_height=0.03)
    drive = sm.Drive(constant=sm.Constant(rate=0.4))
    rail = sm.Joint("prismatic", "ground", "block", axis="x", ends="outboard", friction=rub, drive=drive)
    return sm.Scene({"block": sm.Body(box=(0.1, 0.1, 0.1), mass=2.0)}, {"rail": rail}, "rail", gravity=(0.0, 0.0, -GRAVITY))


def spun(pin: str) -> sm.Scene:
    """A balanced rotor that turns steadily. Its weight always presses a level pin downwards."""
    rub = sm.Friction(mu=0.2, radius=0.01, half_length=0.02)
    drive = sm.Drive(constant=sm.Constant(rate=2 * np.pi))
    joint = sm.Joint("revolute", "ground", "rotor", axis="y", pin=pin, friction=rub, drive=drive)
    body = sm.Body(cylinder=sm.Cylinder(radius=0.1, length=0.05, axis="y"), mass=3.0)
    return sm.Scene({"rotor": body}, {"pin": joint}, "rotor", gravity=(0.0, 0.0, -GRAVITY))


def test_a_block_on_a_rail_wears_by_weight_times_way() -> None:
    r = simulate(block(), until=2.0)
    w = wear(r, K)
    total = sum(c.volume for c in w.contacts)
    moment = 0.2 * 2.0 * GRAVITY * 0.03 / (2 * 0.05)  # friction below the rail's middle moves load from one end to the other
    ends = 2.0 * GRAVITY / 2 + np.array([-1, 1]) * moment
    assert total == pytest.approx(K * 2.0 * GRAVITY * 0.8, rel=1e-10)
    assert sorted(c.load for c in w.contacts if c.load > 1e-12) == pytest.approx(sorted(ends * 0.8), rel=1e-9)
    for c in w.contacts[2:4]:
        assert c.distance == pytest.approx(0.8, rel=1e-12)
        assert c.depth[0] == pytest.approx(c.volume / (2 * 0.05 * 0.02), rel=1e-12)
        assert c.energy == pytest.approx(0.2 * c.load / (2 * 0.05 * 0.02), rel=1e-12)
        assert c.cycles(1e-6) == pytest.approx(1e-6 / c.depth[0])


@pytest.mark.parametrize("name", ["crank_slider", "double_pendulum"])
def test_loads_are_the_work_of_friction_over_its_ratio(name: str) -> None:
    """The reference is the work of friction over one turn of the paper's examples. The runtime integrates this work by another
    method."""
    r = simulate(name, until=1.0 if name == "crank_slider" else 0.5, every=5e-4, rtol=1e-12)
    w = wear(r, K)
    seen = 0
    for joint, j in r.scene.joints.items():
        if j.friction is None or (name == "double_pendulum" and j.type != "cylindrical"):
            continue
        loads = sum(c.load for c in w.contacts if c.joint == joint)
        assert loads == pytest.approx(-r[f"{joint}.friction.work"][-1] / j.friction.mu, rel=1e-10)
        seen += 1
    assert seen


@pytest.mark.parametrize("name", ["crank_slider", "double_pendulum"])
def test_wear_around_the_pin_and_its_bearing_sums_to_the_worn_volume(name: str) -> None:
    w = wear(simulate(name, until=0.5), K)
    for c in (c for c in w.contacts if c.angles.size):
        joint = load_scene(name).joints[c.joint].friction
        radius = joint.radius if isinstance(joint.radius, float) else joint.radius[(c.contact - 1) // 2]
        half = joint.half_length if isinstance(joint.half_length, float) else joint.half_length[(c.contact - 1) // 2]
        for depth in (c.on_pin, c.on_bearing):
            assert depth.sum() * 2 * np.pi / BINS * radius * half == pytest.approx(c.volume, rel=1e-9)


@pytest.mark.parametrize("pin", ["inboard", "outboard"])
def test_a_load_that_stands_still_wears_one_side_of_what_stands_and_all_around_what_turns(pin: str) -> None:
    w = wear(simulate(spun(pin), until=3.0, every=0.001), K)
    for c in w.contacts:
        standing, turning = (c.on_pin, c.on_bearing) if pin == "inboard" else (c.on_bearing, c.on_pin)
        assert np.count_nonzero(standing > 1e-6 * standing.max()) == 1
        assert turning == pytest.approx(np.full(BINS, turning.mean()), rel=0.02)  # bins are 5° wide; rows are 0.36° apart
        assert c.load == pytest.approx(3.0 * GRAVITY / np.hypot(1.0, 0.2) / 2 * 0.01 * 2 * np.pi * 3.0, rel=1e-9)


def pieces(ends: np.ndarray, random: np.random.Generator) -> list[np.polynomial.Polynomial]:
    """A separate polynomial of degree 5 for each span between two ends."""
    return [np.polynomial.Polynomial(random.normal(size=6), domain=(a, b)) for a, b in pairwise(ends)]


@pytest.mark.parametrize("seed", range(6))
def test_polynomials_of_degree_five_between_events_are_integrated_to_the_last_digits(seed: int) -> None:
    """Cases: rows on a regular grid; rows off this grid; rows at events, which belong to no span; simultaneous events."""
    random = np.random.default_rng(seed)
    ends = np.array([0.0, 0.3, 0.71, 1.0])
    grid = np.arange(0, 101) / 100 if seed % 2 else np.sort(np.concatenate([[0.0, 0.3, 1.0], random.uniform(0, 1, 60)]))
    each = [pieces(ends, random) for _ in range(3)]
    span = np.clip(np.searchsorted(ends, grid, "right") - 1, 0, 2)
    values = np.array([[p[k](t) for k, t in zip(span, grid, strict=True)] for p in each])
    values[:, np.isin(grid, ends[1:-1])] = np.nan  # a row at an event belongs to neither side
    whole = [[p.integ(lbnd=a) for p, a in zip(ps, ends, strict=False)] for ps in each]
    past = [np.cumsum([0.0, *(p(b) for p, b in zip(w, ends[1:], strict=True))]) for w in whole]
    expected = np.array([[past[c][k] + w[k](t) for k, t in zip(span, grid, strict=True)] for c, w in enumerate(whole)])
    assert integral(grid, values, [0.71, 0.3, 0.3, 5.0]) == pytest.approx(expected, abs=1e-11)


def test_a_span_with_few_rows_is_integrated_from_the_rows_that_it_has() -> None:
    time, events = np.array([0.0, 1.0, 2.0, 3.0, 4.0]), [1.5, 1.6, 2.5, 3.5, 3.75]
    found = integral(time, np.array([[2.0, 4.0, 7.0, 1.0, 5.0]]), events)[0]
    # ``before``: a line through the first two rows up to 1.5; no row lies between 1.5 and 1.6, so the row at 1.0 counts
    before = (2 * 1.5 + 1.5**2) + 0.1 * 4.0
    ends = before + 0.9 * 7.0 + 1.0 * 1.0 + 0.25 * 1.0 + 0.25 * 5.0
    assert found == pytest.approx([0.0, 3.0, before + 0.4 * 7.0, before + 0.9 * 7.0 + 0.5 * 1.0, ends])


@pytest.mark.parametrize("rate", [2 * np.pi, -41.0, 1e4])
def test_where_a_turning_part_wears_is_exact_however_far_it_turns_between_two_rows(rate: float) -> None:
    """A steady load on a part that turns steadily. A bin that the load passes one more time receives one more share of the wear.
    The load passes the bins at both ends of its range only in part."""
    still = spun("inboard")
    turned = replace(still.joints["pin"], drive=sm.Drive(constant=sm.Constant(rate=rate)))
    c = wear(simulate(replace(still, joints={"pin": turned}), until=0.7, every=0.05), K).contacts[0]
    share = c.on_bearing / c.on_bearing.sum() * abs(rate) * 0.7 / (2 * np.pi) * BINS  # number of passes over each bin
    most = np.floor(abs(rate) * 0.7 / (2 * np.pi))
    assert share.sum() == pytest.approx(abs(rate) * 0.7 / (2 * np.pi) * BINS)
    assert np.all((share > most - 1e-6) & (share < most + 1 + 1e-6))
    assert np.count_nonzero((share > most + 1e-6) & (share < most + 1 - 1e-6)) <= 2


def test_wear_needs_no_package_beside_the_plain_installation(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "scipy", None)
    monkeypatch.setitem(sys.modules, "scipy.interpolate", None)
    assert wear(simulate(block(), until=0.1), K).contacts


def test_coefficients_of_the_scene_count_and_without_one_loads_are_reported() -> None:
    scene = block()
    own = replace(scene, joints={"rail": replace(scene.joints["rail"], wear=sm.Wear(k=2 * K))})
    with_k, without = (wear(simulate(s, until=1.0)) for s in (own, scene))
    assert with_k.columns["rail.wear.volume[3]"][-1] == pytest.approx(2 * K * without.columns["rail.wear.load[3]"][-1])
    assert np.isnan(without["rail.contact[3]"].volume)
    assert np.all(np.diff(with_k.columns["rail.wear.volume[3]"]) > 0.0)


def test_columns_that_are_missing_are_reported() -> None:
    with pytest.raises(SceneError, match=r"rail\.contact\[1\]\.normal_force"):
        wear(simulate(block(), until=0.1, outputs=("rail.q[*]",)), K)


def test_the_command_counts_runs_to_a_depth(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    picture, file = tmp_path / "wear.png", tmp_path / "wear.csv"
    words = ["wear", "crank_slider", "--until", "0.5", "-k", "1e-6 mm^3/(N*m)", "--depth", "10 um"]
    assert main([*words, "--plot", str(picture), "-o", str(file)]) == 0
    assert "runs to that depth" in capsys.readouterr().out
    assert picture.stat().st_size > 10_000
    assert file.read_text().startswith("time,slider_pin.wear.volume[1]")
    assert main(["wear", "crank_slider", "-k", "1e-6 m/s", "--depth", "ten"]) == 2


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.slow
def test_wear_beside_stiff_stops_does_not_depend_on_the_rows(seed: int) -> None:
    """A pendulum strikes a stop, and the load agrees with friction's own work."""
    rng = np.random.default_rng(seed)
    mu = rng.uniform(0.05, 0.2)
    rub = sm.Friction(mu=mu, radius=0.01, half_length=0.02)
    stops = sm.EndStops(stiffness=10 ** rng.uniform(4.0, 8.0), damping=rng.uniform(0.0, 0.1), lower=rng.uniform(-1.4, -0.6))
    pivot = sm.Joint("revolute", "ground", sm.Side("bar", (-0.25, 0.0, 0.0)), axis="z", friction=rub, end_stops=stops,
                     start=sm.Start(q=rng.uniform(0.5, 1.2)))  # fmt: skip
    scene = sm.Scene({"bar": sm.Body(box=(0.5, 0.04, 0.04), density=7800.0)}, {"pivot": pivot}, "bar", gravity=(0.0, -GRAVITY, 0.0))
    larger = scaled(scene, 1e3, 1.0, 1e3**0.5)
    images = (scene, image(scene, random_rotation(rng)), image(scene, np.diag([1.0, -1.0, 1.0])), larger)
    kernel, settings = "compiled" if seed % 2 else "parts", [("auto", 1e-8), ("rosenbrock", 1e-6)]
    for made, size in zip(images, (1.0, 1.0, 1.0, 1e3), strict=True):
        for method, rtol in (*settings, *((m, 1e-4) for m in ("rk5", "rk8", "rosenbrock", "moreau"))):
            found = []
            for every in (3e-3, 3e-4):
                r = simulate(made, until=2.0 * size**0.5, every=every * size**0.5, rtol=rtol, method=method, kernel=kernel)
                assert any(e.kind == "end_stop_engaged" for e in r.events)
                found.append(sum(c.load for c in wear(r, K).contacts))
            assert found == pytest.approx([-r["pivot.friction.work"][-1] / mu] * 2, rel=max(3e-4, 10.0 * rtol))


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(("family", "seed"), [
    ("racks", 20036), ("slots", 20013), ("geared_linkages", 20073), ("screw_levers", 1), ("grippers", 1), ("hooks_in_loops", 0),
])  # fmt: skip
def test_loads_of_random_mechanisms_are_the_work_of_friction_over_its_ratio(family: str, seed: int) -> None:
    """Each run has 200 rows."""
    scene = crossed(family, seed)
    until = min(scene.simulation.until or 1.0, 1.0)
    r = simulate(scene, until=until, every=until / 200, rtol=1e-8)
    w = wear(r, K)
    for name, j in scene.joints.items():
        rub = j.friction
        if rub is None or not isinstance(rub.mu, float) or rub.law not in (None, "coulomb") or rub.preload or rub.thrust_radius:
            continue
        loads = sum(c.load for c in w.contacts if c.joint == name)
        assert loads == pytest.approx(-r[f"{name}.friction.work"][-1] / rub.mu, rel=3e-4, abs=1e-7)


def test_the_load_before_a_jam_does_not_depend_on_the_rows() -> None:
    """The load grows without bound towards the jam."""
    scene = crossed("winches", 20074)
    runs = [simulate(scene, until=0.5, every=0.5 / rows, rtol=1e-8, kernel="parts") for rows in (50, 2000)]
    assert {r.outcome.name for r in runs} == {"jammed"}
    first, second = ([c.load for c in wear(r, K).contacts] for r in runs)
    assert first == second
