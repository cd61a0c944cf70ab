"""Closed loops. Start values close the loops, and the loops stay closed throughout a run. The motion passes configurations where
the number of freedoms changes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.engine.mechanisms.paper_examples_closed_form import slider_crank
from tests.paper_friction_law import PAPER
from tests.reference.scenes.random_friction_scenes import rubbing
from tests.scalable_mechanisms import n_four_bar
from trunnion.scene import Scene, load_scene
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import simulate

CLOSURE = 1e-9
"""Allowed gap: lengths by the length scale, angles in rad. Projection leaves round-off (4e-15). Without projection, loops drift far
beyond the allowed gap in 1000 s."""


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(
    ("name", "until"), [("crank_slider", 1000.0), ("bricard", 100.0), ("n_four_bar", 100.0), ("crank_slider_free", 100.0)]
)
def test_loops_stay_closed(name: str, until: float) -> None:
    r = simulate(name, until=until, every=until / 500, outputs=["audit.constraint", "energy.kinetic", "energy.potential"])
    assert r.outcome.ok
    assert r["audit.constraint"].max() <= CLOSURE
    if name != "crank_slider":  # the drive of crank_slider changes its energy
        energy = r["energy.kinetic"] + r["energy.potential"]
        assert np.ptp(energy) <= 2e-3 * r["energy.kinetic"].max()  # the run has a thousand swings at rtol 1e-6


@pytest.mark.parametrize("rtol", [1e-2, 1e-3, 1e-4])
def test_redundant_rows_cost_no_steps_at_loose_tolerance(rtol: float) -> None:
    """Inside a step the loop is open by the step's error, and the redundant row looks independent. If the solver treated the row as
    independent, the run would take thousands of additional steps."""
    r = simulate("bricard", until=10.0, every=0.1, rtol=rtol)
    assert r.outcome.ok
    assert r.stats.steps < 150
    assert np.ptp(r["energy.kinetic"] + r["energy.potential"]) <= 2000 * rtol * r["energy.kinetic"].max()


def test_the_closure_reported_is_the_gap_in_the_loop() -> None:
    """The test recomputes the gap from the positions of the bodies: the rod's end must be on the slider, and both must be on the
    guide."""
    r = simulate("crank_slider", until=3.0, every=0.05, overrides=PAPER)
    gap = [r[f"rod.end.position[{k}]"] - r[f"slider.position[{k}]"] for k in (1, 2, 3)]
    pin = [r[f"crank.pin.position[{k}]"] + r[f"rod.end.position[{k}]"] - 2 * r[f"rod.position[{k}]"] for k in (1, 2, 3)]
    assert np.abs([*gap, *pin]).max() <= 1e-13
    assert np.abs([r["slider.position[2]"], r["slider.position[3]"]]).max() <= 1e-13


def started(scene: Scene, **starts: sm.Start | None) -> Scene:
    """The scene with other start values for the named joints."""
    return replace(
        scene, joints={n: replace(j, start=starts.get(n, j.start)) if n in starts else j for n, j in scene.joints.items()}
    )


def free_crank(**starts: sm.Start | None) -> Scene:
    """The undriven crank-slider. Joints that are not named have no start values."""
    none = dict.fromkeys(("crank_pivot", "slider_pin", "guide"))
    return started(load_scene("crank_slider_free"), **{**none, **starts})


def test_assembly_finds_coordinates_that_are_not_given_and_keeps_given_ones() -> None:
    r = simulate(free_crank(crank_pivot=sm.Start(q=0.7, qd=3.0)), until=1e-3, every=1e-3)
    closed = slider_crank(0.7, 3.0)
    assert r["crank_pivot.q[1]"][0] == 0.7
    assert r["crank_pivot.qd[1]"][0] == 3.0
    assert r["guide.q[1]"][0] == pytest.approx(closed.x, abs=1e-12)
    assert closed.x == pytest.approx(0.5 * np.cos(0.7) + np.sqrt(1 - (0.5 * np.sin(0.7)) ** 2), abs=1e-12)
    assert not any("moved" in n for n in r.notes)


def test_start_rates_are_assembled() -> None:
    closed = slider_crank(0.7, 3.0)
    places = {"guide": sm.Start(q=float(closed.x)), "slider_pin": sm.Start(q=float(closed.rod))}
    r = simulate(free_crank(crank_pivot=sm.Start(q=0.7, qd=3.0), **places), until=1e-3, every=1e-3)
    assert r["crank_pivot.qd[1]"][0] == 3.0
    assert r["guide.qd[1]"][0] == pytest.approx(closed.speed, abs=1e-12)
    assert r["slider_pin.qd[1]"][0] == pytest.approx(closed.rod_rate, abs=1e-12)
    assert r["audit.constraint"][0] <= 1e-13
    assert not any("moved" in n for n in r.notes)


def test_given_values_that_disagree_share_the_change() -> None:
    r = simulate(free_crank(crank_pivot=sm.Start(q=0.7), guide=sm.Start(q=1.2)), until=1e-3, every=1e-3)
    crank, guide = r["crank_pivot.q[1]"][0], r["guide.q[1]"][0]
    assert guide == pytest.approx(slider_crank(crank).x, abs=1e-12)
    assert 0.7 < crank < 0.8
    assert 1.2 < guide < slider_crank(0.7).x
    assert {n.partition(":")[0] for n in r.notes if "moved" in n} == {"crank_pivot", "guide"}


def test_wrong_start_values_are_moved_and_reported() -> None:
    scene = started(load_scene("crank_slider"), guide=sm.Start(q=1.3, qd=0.5), slider_pin=sm.Start(q=0.3, qd=-4.0))
    r = simulate(scene, until=1e-3, every=1e-3)
    moved = [n for n in r.notes if "moved" in n]
    assert r["guide.q[1]"][0] == pytest.approx(1.5, abs=1e-12)
    assert r["slider_pin.q[1]"][0] == pytest.approx(0.0, abs=1e-6)  # at the dead centre the closure is quadratic in this coordinate
    assert r["slider_pin.qd[1]"][0] == pytest.approx(-5.0, abs=1e-9)
    for joint, what, was in (("guide", "q", "1.3"), ("guide", "qd", "0.5"), ("slider_pin", "q", "0.3"), ("slider_pin", "qd", "-4")):
        assert any(n.startswith(f"{joint}: start {what} moved from {was} to") for n in moved), (joint, what)


def test_right_start_values_are_not_touched() -> None:
    for name in ("crank_slider", "bricard", "n_four_bar", "andrews", "spatial_slider_crank"):
        r = simulate(name, until=1e-4, every=1e-4)
        assert not any("moved" in n for n in r.notes), name


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", [6, 26, 116, 297])
def test_a_start_that_can_be_kept_is_kept_whatever_is_left_open(seed: int) -> None:
    """All joints of a loop except the last have start values that close the loop. The last joint has no start value, and its angle
    may have any size."""
    case = rubbing("loop", seed)
    (open_joint,) = [n for n, j in case.scene.joints.items() if j.start is None]
    r = simulate(case.scene, until=1e-9, every=1e-9, outputs=["*.q[*]"])
    assert not any("moved" in n for n in r.notes)
    assert abs(case.q[open_joint]).max() > 0.0


def test_start_values_of_a_cut_joint_are_reported_to_be_unused() -> None:
    scene = load_scene("bricard")
    scene = replace(scene, joints={n: replace(j, start=sm.Start(q=0.0), cut=n == "j5") for n, j in scene.joints.items()})
    r = simulate(scene, until=1e-3, every=1e-3)
    assert any("j5" in n and "not used" in n for n in r.notes)


@pytest.mark.parametrize("start", [np.pi / 2, 2.0])
def test_loops_that_cannot_close_give_an_outcome(start: float) -> None:
    """A rod of 0.3 m does not reach the guide from a crank pin 0.5 sin(φ) m above it."""
    scene = load_scene("crank_slider")
    bodies = scene.bodies | {"rod": replace(scene.bodies["rod"], points={"end": (0.3, 0.0, 0.0)})}
    drive = sm.Drive(constant=sm.Constant(rate=10.0, start=float(start)))
    joints = scene.joints | {"crank_pivot": replace(scene.joints["crank_pivot"], drive=drive)}
    r = simulate(replace(scene, bodies=bodies, joints=joints), until=0.1)
    assert (r.outcome.name, r.outcome.time, r.outcome.ok) == ("open_loop", 0.0, False)
    assert r.outcome.joint == "crank_pin"  # the loop is cut at this joint
    assert "positions" in r.outcome.advice
    assert len(r) == 0
    assert r.time.shape == (0,)


def test_rates_that_contradict_each_other_give_an_outcome() -> None:
    """At the dead centre the slider cannot move, but the slider's drive prescribes a rate."""
    scene = load_scene("crank_slider")
    drive = sm.Drive(constant=sm.Constant(rate=1.0, start=1.5))
    r = simulate(
        replace(scene, joints=scene.joints | {"guide": replace(scene.joints["guide"], drive=drive, start=None)}), until=0.1
    )
    assert (r.outcome.name, r.outcome.time) == ("open_loop", 0.0)
    assert "velocities" in r.outcome.advice


def tip(n: int, t: float) -> np.ndarray:
    """Tip of the first crank of the N-four-bar. All cranks are parallel: θ̈ = −((N+1)/2+N)/((N+1)/3+N) g cos θ."""
    k = ((n + 1) / 2 + n) / ((n + 1) / 3 + n) * 9.81
    y = solve_ivp(lambda t, y: [y[1], -k * np.cos(y[0])], (0, t), [np.pi / 2, -1.0], "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    assert y[0] < -np.pi / 2  # the crank has passed the horizontal, where the number of freedoms jumps from 1 to N + 1
    return np.array([np.cos(y[0]), np.sin(y[0])])


@pytest.mark.parametrize("n", [2, 10, pytest.param(40, marks=pytest.mark.slow)])
def test_n_four_bar_passes_its_singular_configuration(n: int) -> None:
    r = simulate(n_four_bar(n), until=2.0, every=0.01, rtol=1e-11, outputs=["crank0.tip*", "pivot*.q[1]", "audit.constraint"])
    assert r.outcome.ok
    assert [r["crank0.tip.position[1]"][-1], r["crank0.tip.position[2]"][-1]] == pytest.approx(tip(n, 2.0), abs=1e-8)
    assert r["audit.constraint"].max() <= CLOSURE
    spread = np.ptp([r[f"pivot{i}.q[1]"] for i in range(n + 1)], axis=0)
    assert spread.max() <= 1e-7  # cranks are parallel to half of the digits, because flat loops close only to second order


SOAKED = ("bricard", "crank_slider", "crank_slider_free", "n_four_bar")
SPANS = [1000.0, pytest.param(20000.0, marks=pytest.mark.slow)]


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("until", SPANS)
@pytest.mark.parametrize("name", SOAKED)
def test_loops_stay_closed_for_long(name: str, until: float) -> None:
    r = simulate(name, until=until, every=until / 1000, outputs=["audit.constraint"])
    assert r.outcome.ok
    assert r["audit.constraint"].max() <= CLOSURE


@pytest.mark.parametrize("gap", [1e-3, 0.1, 0.5])
def test_links_that_start_exactly_in_line_close_to_a_side(gap: float) -> None:
    """Two bars of 1 m between pivots that are 2 m − gap apart. From the straight line, no first-order change closes the gap."""
    bar = sm.Body(box=(1.0, 0.05, 0.05), density=2700.0, points={"a": (-0.5, 0.0, 0.0), "b": (0.5, 0.0, 0.0)})
    joints = {
        "p": sm.Joint("revolute", "ground", "crank.a", axis="z"),
        "q": sm.Joint("revolute", "crank.b", "rod.a", axis="z"),
        "r": sm.Joint("revolute", "rod.b", sm.Side("ground", (2.0 - gap, 0.0, 0.0)), axis="z"),
    }
    r = simulate(sm.Scene({"crank": bar, "rod": bar}, joints, "in_line"), until=0.01)
    assert r.outcome.ok
    lean = np.arccos(1.0 - gap / 2.0)
    assert abs(r["p.q[1]"][0]) == pytest.approx(lean, abs=1e-12)
    assert r["q.q[1]"][0] == pytest.approx(-2.0 * r["p.q[1]"][0], abs=1e-12)
    joints["r"] = replace(joints["r"], outboard=sm.Side("ground", (2.0 + gap, 0.0, 0.0)))
    assert simulate(sm.Scene({"crank": bar, "rod": bar}, joints, "too_far"), until=0.01).outcome.name == "open_loop"
