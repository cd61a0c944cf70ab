"""Required results of the paper's examples 8.1, 8.2 and 8.3."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from tests.engine.mechanisms.paper_examples_closed_form import pendulum_run, slider_crank
from tests.paper_friction_law import PAPER
from trunnion.analysis.mechanics.state_evaluation import evaluate
from trunnion.scene import load_scene
from trunnion.scene.overrides import apply
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import Model, simulate


@cache
def pendulum(normal_force: str = "exact", every: float = 0.01) -> Result:
    """A run of example 8.1 with v_eps = 1e-4 m/s at rtol 1e-9."""
    changes = PAPER | {"friction.normal_force": normal_force}
    return simulate("spherical_pendulum", until=10.0, every=every, rtol=1e-9, overrides=changes)


def angle(r: Result) -> np.ndarray:
    """Angle of the pendulum from the downward vertical, degrees."""
    return np.degrees(np.arctan2(r["pendulum.position[1]"], -r["pendulum.position[3]"]))


def turned_over(r: Result) -> float:
    """Converted energy: the rise and fall of kinetic energy plus the dissipated energy, J."""
    return float(np.abs(np.diff(r["energy.kinetic"])).sum() + r["energy.dissipated"][-1])


# -- 8.1 ----------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("t", "degrees"), [(2.0, 57.5007026), (7.0, 19.2749251)])
def test_the_pendulum_has_the_known_angles(t: float, degrees: float) -> None:
    row = round(t / 0.01)
    assert pendulum().time[row] == pytest.approx(t, abs=1e-12)
    assert angle(pendulum())[row] == pytest.approx(degrees, abs=1e-6)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("normal_force", ["exact", "adams"])
def test_pendulum_is_the_one_freedom_it_is_in_its_plane(normal_force: str) -> None:
    _, truth = pendulum_run(adams=normal_force == "adams")
    r = pendulum(normal_force)
    expected = np.degrees([truth(float(t)) for t in r.time])
    assert np.abs(angle(r) - expected).max() <= 3e-6  # errors of steps at rtol add up to fifty times rtol
    assert np.abs(r["pendulum.position[2]"]).max() <= 1e-15  # the pendulum never leaves its plane


def test_pendulum_accounts_for_its_energy() -> None:
    r = pendulum()
    assert np.abs(r["energy.residual"]).max() <= 1e-8 * turned_over(r)
    assert np.all(np.diff(r["energy.dissipated"]) >= 0.0)
    assert r["ball.friction.work"] == pytest.approx(-r["energy.dissipated"], abs=1e-12)


def test_pendulums_normal_force_and_torque_are_coulombs_while_it_slides() -> None:
    r = pendulum()
    force = np.linalg.norm([r[f"ball.reaction.force[{k}]"] for k in (1, 2, 3)], axis=0)
    sliding = np.abs(r["ball.qd[2]"]) * 0.05 > 1.1e-4
    assert np.count_nonzero(sliding) > 800
    normal = r["ball.contact[1].normal_force"][sliding]
    assert normal == pytest.approx(force[sliding] / np.sqrt(1.36), rel=1e-12)
    assert np.abs(r["ball.friction.torque[2]"][sliding]) == pytest.approx(0.05 * 0.6 * normal, rel=1e-12)


def test_adams_torque_is_larger_by_the_cosine_of_the_friction_angle() -> None:
    """μ r |f| compared with μ r |f|/√(1+μ²), where f is the reaction of each run."""
    torque, force = {}, {}
    for how in ("exact", "adams"):
        r = pendulum(how)
        torque[how] = np.abs(r["ball.friction.torque[2]"])
        force[how] = np.linalg.norm([r[f"ball.reaction.force[{k}]"] for k in (1, 2, 3)], axis=0)
    sliding = np.abs(pendulum("adams")["ball.qd[2]"]) * 0.05 > 1.1e-4
    assert (torque["adams"] / force["adams"])[sliding] == pytest.approx(0.05 * 0.6, rel=1e-12)
    sliding = np.abs(pendulum("exact")["ball.qd[2]"]) * 0.05 > 1.1e-4
    assert (torque["exact"] / force["exact"])[sliding] == pytest.approx(0.05 * 0.6 / np.sqrt(1.36), rel=1e-12)
    stops = [e.time for e in pendulum("adams").events if e.kind == "reversal"]
    assert stops[8] == pytest.approx(7.719892376511769, abs=1e-6)  # the paper reads 7.7 s
    assert len(stops) == 9  # one stop less than with exact contacts, because the pendulum comes to rest earlier
    assert pendulum("adams")["energy.dissipated"][200] > pendulum("exact")["energy.dissipated"][200]


# -- 8.2 ----------------------------------------------------------------------------------------------------------------------


def test_slider_follows_the_closed_form() -> None:
    r = simulate("crank_slider", until=10.0, every=0.01, rtol=1e-9, overrides=PAPER)
    x = 0.5 * np.cos(10 * r.time) + np.sqrt(1 - 0.25 * np.sin(10 * r.time) ** 2)
    assert np.abs(r["slider.position[1]"] - x).max() <= 1e-9
    assert np.abs(r["energy.residual"]).max() <= 1e-8 * turned_over(r)
    assert r["slider_pin.contact[1].normal_force"] == pytest.approx(r["slider_pin.contact[2].normal_force"], rel=1e-9)


@pytest.mark.parametrize("normal_force", ["exact", "adams"])
def test_slider_pin_carries_the_closed_form(normal_force: str) -> None:
    """The crank angles are random, and the crank is slow or fast: the law is below or above its v_eps."""
    rng = np.random.default_rng(8)
    changes = PAPER | {"friction.normal_force": normal_force, "friction.v_eps": 0.01}
    model = Model(apply(load_scene("crank_slider"), changes), ("*",))
    slow = 0
    for phi in [*rng.uniform(0, 2 * np.pi, 40), np.pi / 2 + 0.02, np.pi / 2 - 0.1]:
        s = slider_crank(phi, v_eps=0.01, adams=normal_force == "adams")
        slow += abs(s.rod_rate) * 0.01 < 0.01
        row = evaluate(model, {"slider_pin": [s.rod], "guide": [s.x]}, {"slider_pin": [s.rod_rate], "guide": [s.speed]}, phi / 10)
        size = np.abs(s.force).max()
        force = [row["slider_pin.reaction.force[2]"], row["slider_pin.reaction.force[3]"]]  # e2 points along the guide, e3 up
        assert force == pytest.approx(list(s.force), abs=1e-9 * size)
        assert -row["slider_pin.friction.torque[1]"] == pytest.approx(s.torque, rel=1e-9, abs=1e-12 * size)
        pressed = [row[f"slider_pin.contact[{i}].normal_force"] for i in (1, 2)]
        # with Adams' normal force, the contacts still follow the exact forms
        expected = s.normal_force if normal_force == "exact" else pressed[0]
        assert pressed == pytest.approx([expected, expected], rel=1e-9)
    assert 3 <= slow <= 39


# -- 8.3 ----------------------------------------------------------------------------------------------------------------------


def test_pivot_slides_as_computed_by_two_other_formulations() -> None:
    r = simulate("double_pendulum", until=1.0, every=0.25, rtol=1e-10, overrides=PAPER)
    assert r["guide.q[1]"][[1, 2, 4]] == pytest.approx([2.45822549, 4.71556293, 8.32814917], abs=1e-6)


def test_pivot_comes_to_rest_and_the_minute_is_completed() -> None:
    r = simulate("double_pendulum", until=60.0, every=0.5, overrides=PAPER)
    assert r.outcome.ok
    assert r["guide.q[1]"][9] == pytest.approx(13.75, abs=0.02)  # row at 4.5 s; the motion is sensitive after the first second
    assert r["guide.q[1]"][-1] == pytest.approx(13.75, abs=0.03)
    late = r.time > 20.0
    assert np.abs(r["guide.qd[1]"][late]).max() <= 1e-4  # only the creep of the regularised law remains, at most v_eps
    assert np.abs(r["energy.residual"]).max() <= 1e-4 * turned_over(r)  # the run has rtol 1e-6


def test_a_short_guide_jams_from_the_start_and_says_where() -> None:
    """The half length is c = 0.15 m. The inertia force acts beyond c/μ, and the complement equations have no root (F3)."""
    r = simulate("double_pendulum", until=1.0, overrides=PAPER | {"joints.guide.friction.half_length": 0.15})
    assert r.outcome.name == "no_solution"
    assert r.outcome.joint == "guide"
    assert r.outcome.time <= 1e-6
    assert "half_length" in r.outcome.advice


@pytest.mark.parametrize("half_length", [0.16, 0.17])
def test_a_guide_shorter_than_the_threshold_jams_too(half_length: float) -> None:
    r = simulate("double_pendulum", until=0.01, overrides=PAPER | {"joints.guide.friction.half_length": half_length})
    assert r.outcome.name == "no_solution"


@pytest.mark.parametrize("half_length", [0.19, 0.2, 0.25])
def test_a_guide_above_the_threshold_slides(half_length: float) -> None:
    r = simulate("double_pendulum", until=0.01, overrides=PAPER | {"joints.guide.friction.half_length": half_length})
    assert r.outcome.ok
    assert r["audit.complement"].max() <= 1e-12
