"""Derivatives along a run, compared with closed forms and with differences, away from events and across them."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import trunnion
from trunnion.basics.errors import SceneError, SimulationError
from trunnion.cli import main
from trunnion.scene import load_scene
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.overrides import apply, list_parameters

SMOOTH, ACROSS = 1e-7, 1e-5
"""Required relative precision of gradients, away from events and across them."""
WEIGHTS = ((-3, -1 / 60), (-2, 3 / 20), (-1, -3 / 4), (1, 3 / 4), (2, -3 / 20), (3, 1 / 60))


def differences(scene: Scene, name: str, outputs: list[str], until: float, every: float) -> np.ndarray:
    """d(outputs)/d(parameter) over time, by differences of order six between runs at 1e-12: precise to about 1e-9."""
    value = {p.path: p.value for p in list_parameters(scene)}[name]
    h = 2e-3 * (abs(value) or 1.0)
    total: np.ndarray | float = 0.0
    for k, w in WEIGHTS:
        there = {name: value + k * h}
        r = trunnion.simulate(scene, until=until, every=every, rtol=1e-12, method="rk8", outputs=outputs, overrides=there)
        assert r.outcome.ok
        total = total + w / h * r.data[:, 1:]
    return np.asarray(total)


def off(scene: Scene | str, names: list[str], outputs: list[str], until: float, rows: int = 10) -> float:
    """Largest difference between ``sensitivity`` and ``differences`` over all columns and times, relative to the largest derivative
    of the column."""
    loaded = load_scene(scene) if isinstance(scene, str) else scene
    s = trunnion.sensitivity(loaded, names, outputs, until, until / rows)
    worst = 0.0
    for k, name in enumerate(names):
        d = differences(loaded, name, outputs, until, until / rows)
        scale = np.abs(d).max(axis=0)
        still = scale <= 1e-9 * scale.max()  # differences of columns that do not depend on the parameter are noise
        error = np.abs(s.derivatives[:, :, k] - d).max(axis=0)
        worst = max(worst, float((error / np.where(still, scale.max(), scale)).max()))
    return worst


def test_a_pendulum_of_small_swing_has_the_derivative_of_its_closed_form() -> None:
    """Linear spring: x = cos(t √(k/m)), dx/dk = −t/(2√(k m)) sin(t √(k/m)), to the run's own tolerance."""
    scene = trunnion.scene.scene_from_dict({  # type: ignore[attr-defined]
        "schema": 1, "name": "oscillator", "gravity": [0, 0, 0],
        "bodies": {"m": {"mass": 2.0, "inertia": [1, 1, 1]}},
        "joints": {"rail": {"type": "prismatic", "axis": "x", "inboard": "ground", "outboard": "m", "spring": {"stiffness": 8.0},
                            "start": {"q": 1.0}}},
    })  # fmt: skip
    numbers = ["joints.rail.spring.stiffness", "bodies.m.mass", "joints.rail.start.q"]
    s = trunnion.sensitivity(scene, numbers, ["rail.q[1]"], 5.0, 0.5)
    t, k, m = s.time, 8.0, 2.0
    w = math.sqrt(k / m)
    exact = np.column_stack([-t / (2 * math.sqrt(k * m)) * np.sin(w * t), t * w / (2 * m) * np.sin(w * t), np.cos(w * t)])
    assert np.abs(s.derivatives[:, 0, :] - exact).max() < 1e-7 * np.abs(exact).max()


def test_a_run_that_stays_at_rest_has_accurate_derivatives() -> None:
    """The state is constant, so the integrator takes one long step. The derivative dx/dx₀ = cos(t √(k/m)) needs shorter steps."""
    scene = trunnion.scene.scene_from_dict({  # type: ignore[attr-defined]
        "schema": 1, "name": "oscillator", "gravity": [0, 0, 0],
        "bodies": {"m": {"mass": 2.0, "inertia": [1, 1, 1]}},
        "joints": {"rail": {"type": "prismatic", "axis": "x", "inboard": "ground", "outboard": "m", "spring": {"stiffness": 8.0},
                            "start": {"q": 0.0}}},
    })  # fmt: skip
    s = trunnion.sensitivity(scene, ["joints.rail.start.q"], ["rail.q[1]"], 20.0, 0.5)
    assert np.abs(s.derivatives[:, 0, 0] - np.cos(2.0 * s.time)).max() < 1e-6


def test_samples_do_not_change_derivatives() -> None:
    mu, column = ["joints.ball.friction.mu"], ["ball.qd[2]"]
    few, many = (trunnion.sensitivity("spherical_pendulum", mu, column, 2.0, every) for every in (2.0, 0.013))
    assert many.derivatives[-1] == pytest.approx(few.derivatives[-1], rel=1e-12)


def test_derivatives_of_an_open_chain_and_of_a_loop_with_springs_are_those_of_differences() -> None:
    names = ["bodies.K1.mass", "forces.spring.stiffness", "joints.beta.effort"]
    assert off("andrews", names, ["K1.position[*", "beta.q*"], 0.01) < SMOOTH
    assert off("governor", ["bodies.slider.density"], ["pin_right.q*", "spin.qd*"], 0.002) < SMOOTH


def test_reactions_and_contacts_have_derivatives() -> None:
    scene = apply(load_scene("crank_slider"), {"friction.law": "regularized", "friction.v_eps": 1e-3})
    outputs = ["crank_pivot.drive.effort[1]", "slider_pin.friction.torque[1]", "slider_pin.contact[1].normal_force"]
    names = ["joints.slider_pin.friction.mu", "bodies.rod.density"]
    assert off(scene, names, outputs, 0.14) < SMOOTH  # the run ends before the pin's first stop


def test_kinks_of_the_regularised_law_cost_nothing() -> None:
    """Friction and its derivatives are continuous where the branches of the law meet. The run contains three stops."""
    scene = apply(load_scene("spherical_pendulum"), {"friction.law": "regularized", "friction.v_eps": 1e-2})
    names = ["joints.ball.friction.mu", "joints.ball.friction.radius"]
    assert off(scene, names, ["pendulum.position[1]", "pendulum.position[3]", "ball.qd[2]"], 3.1) < ACROSS


class TestCoulomb:
    """Set-valued friction: ẏ jumps at every reversal, whose time depends on the parameters."""

    def test_derivatives_before_the_first_reversal_are_those_of_differences(self) -> None:
        scene = apply(load_scene("spherical_pendulum"), {"friction.law": "coulomb"})
        assert off(scene, ["joints.ball.friction.mu"], ["pendulum.position[1]", "ball.qd[2]"], 0.8) < SMOOTH

    def test_derivatives_across_five_reversals_are_those_of_differences(self) -> None:
        scene = apply(load_scene("spherical_pendulum"), {"friction.law": "coulomb"})
        names = ["joints.ball.friction.mu", "joints.ball.friction.radius", "gravity[3]"]
        assert off(scene, names, ["pendulum.position[1]", "pendulum.position[3]"], 5.0) < ACROSS
        s = trunnion.sensitivity(scene, names[:1], ["ball.qd[2]"], 5.0)
        assert len(s.events) == 5

    def test_reversals_cost_no_digits(self) -> None:
        scene = load_scene("spherical_pendulum")
        assert off(scene, ["joints.ball.friction.mu"], ["pendulum.position[1]", "ball.qd[2]"], 2.9) < 1e-8

    def test_a_slow_turn_of_sliding_is_no_event(self) -> None:
        """At 3.8203 s the guide of example 8.3 slides at 2e-5 m/s. The direction of sliding turns without a stop."""
        s = trunnion.sensitivity("double_pendulum", ["joints.cross.friction.mu"], ["lower.position[1]"], 3.83)
        assert not s.notes

    def test_the_stop_comes_earlier_as_differences_say(self) -> None:
        scene = apply(load_scene("spherical_pendulum"), {"friction.law": "coulomb"})
        s = trunnion.sensitivity(scene, ["joints.ball.friction.mu"], ["ball.qd[2]"], 2.0)
        h = 1e-4
        stops = []
        for sign in (-1, 1):
            r = trunnion.simulate(scene, 2.0, rtol=1e-11, method="rk8", overrides={"joints.ball.friction.mu": 0.6 + sign * h})
            stops.append([e.time for e in r.events])
        for k, e in enumerate(s.events):
            # errors: of order h², and the tolerance of event times
            assert e.shift[0] == pytest.approx((stops[1][k] - stops[0][k]) / (2 * h), rel=1e-5)

    def test_derivatives_of_sliding_and_turning_at_once_are_those_of_differences(self) -> None:
        scene = apply(load_scene("double_pendulum"), {"friction.law": "coulomb"})
        names = ["joints.guide.friction.mu", "joints.cross.friction.mu", "joints.guide.start.qd[1]"]
        assert off(scene, names, ["guide.q*", "guide.friction.force"], 0.5) < ACROSS

    def test_the_place_of_rest_has_the_derivative_of_its_closed_form(self) -> None:
        """A block slides to rest on an incline: x_end = v²/(2 g (μ cos − sin)). The derivative with respect to μ has a closed
        form."""
        g, mu, v = 9.81, 0.3, 2.0
        scene = trunnion.scene.scene_from_dict({  # type: ignore[attr-defined]
            "schema": 1, "name": "block", "gravity": [0, -g, 0], "friction": {"law": "coulomb"},
            "bodies": {"block": {"mass": 2.0, "inertia": [1, 1, 1]}},
            "joints": {"rail": {"type": "prismatic", "axis": "x", "reference": "y", "inboard": "ground", "outboard": "block",
                                "friction": {"mu": mu, "half_length": 10, "half_width": 0.001, "half_height": 0.001},
                                "start": {"q": 0, "qd": v}}},
        })  # fmt: skip
        s = trunnion.sensitivity(scene, ["joints.rail.friction.mu", "joints.rail.start.qd"], ["rail.q[1]", "rail.qd[1]"], 1.0)
        stop = v * v / (2 * mu * g)
        assert s["rail.q[1]"][-1] == pytest.approx(stop, rel=1e-6)  # the arms of the sleeve are small, not zero
        assert s.d("rail.q[1]", "joints.rail.friction.mu")[-1] == pytest.approx(-stop / mu, rel=1e-5)
        assert s.d("rail.q[1]", "joints.rail.start.qd")[-1] == pytest.approx(v / (mu * g), rel=1e-5)
        assert np.abs(s.derivatives[-1, 1]).max() < 1e-12


def test_derivatives_by_the_time_of_a_kink_of_a_signal_are_those_of_the_closed_form() -> None:
    """A force rises within 1 ms at the time ``begin`` (b). The position is then x = a (t − b)²/2, and dx/db = −a (t − b). The joint
    has the name of a key; the program must not mistake the joint for the key."""
    scene = trunnion.scene.scene_from_dict({  # type: ignore[attr-defined]
        "schema": 1, "name": "pushed", "gravity": [0, 0, 0],
        "bodies": {"m": {"mass": 2.0, "inertia": [1, 1, 1]}},
        "joints": {"table": {"type": "prismatic", "axis": "x", "inboard": "ground", "outboard": "m",
                             "effort": {"ramp": {"start": 0, "end": 6, "begin": 0.4, "duration": 1e-3}}}},
    })  # fmt: skip
    s = trunnion.sensitivity(scene, ["joints.table.effort.ramp.begin"], ["table.q[1]"], 1.0, 0.5)
    assert s.derivatives[-1, 0, 0] == pytest.approx(-3.0 * (0.6 - 0.5e-3), rel=1e-9)


def test_all_mistakes_are_reported_at_once() -> None:
    with pytest.raises(SceneError) as e:
        trunnion.sensitivity("spherical_pendulum", ["joints.ball.friction.mew", "simulation.rtol", "gravity"], ["ball.qd*"])
    assert len(e.value.problems) == 3
    with pytest.raises(SceneError, match="no derivative"):
        trunnion.sensitivity("spherical_pendulum", ["joints.ball.friction.mu"], ["events.count"])


@pytest.mark.slow
def test_a_reaction_that_is_not_unique_has_no_derivative() -> None:
    """Bricard's loop is redundant. Its motion is unique, but its reactions are not."""
    with pytest.raises(SceneError, match="not unique"):
        trunnion.sensitivity("bricard", ["bodies.bar1.mass"], ["j2.reaction.force[*"], until=0.05)
    s = trunnion.sensitivity("bricard", ["bodies.bar1.mass"], ["bar3.end.position[*"], until=0.05)
    assert np.isfinite(s.derivatives).all()


def test_the_command_prints_and_writes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["sensitivity", "spherical_pendulum", "--law", "regularized", "--vary", "joints.ball.friction.mu"]
    words += ["--outputs", "ball.qd[2]", "--until", "0.5"]
    file = tmp_path / "s.csv"
    assert main([*words, "-o", str(file)]) == 0
    assert "derivative" in capsys.readouterr().out
    rows = file.read_text().splitlines()
    assert rows[0] == "time,ball.qd[2],d(ball.qd[2])/d(joints.ball.friction.mu)"
    assert len(rows) == 102
    assert main([*words, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["parameters"] == ["joints.ball.friction.mu"]
    assert main(["sensitivity", "spherical_pendulum"]) == 2
    assert "--vary" in capsys.readouterr().err


def test_measured_curves_give_back_the_friction_they_were_made_with() -> None:
    """The data are synthetic, with known friction and noise of 1 mrad. The fit is within four standard deviations of the true
    value, and the standard deviations are correct."""
    law = {"friction.law": "regularized", "friction.v_eps": 1e-3}
    truth = {"joints.ball.friction.mu": 0.45}
    r = trunnion.simulate("spherical_pendulum", 3.0, 0.02, rtol=1e-9, overrides=law | truth, outputs=["pendulum.position[1]"])
    noisy = r["pendulum.position[1]"] + 1e-3 * np.random.default_rng(7).normal(size=len(r.time))
    found = trunnion.fit("spherical_pendulum", list(truth), r.time, {"pendulum.position[1]": noisy}, overrides=law)
    name = next(iter(truth))
    assert found.converged
    assert abs(found.values[name] - 0.45) < 4 * found.deviation[name]
    assert found.misfit == pytest.approx(1e-3, rel=0.2)


def test_derivatives_that_grow_without_bound_end_by_a_name() -> None:
    """A pendulum starts in its upright pose: the motion is one long step. The derivative with respect to the start angle is cosh(99
    t)."""
    body = {"mass": 1.0, "inertia": [1e-9] * 3, "center": [0, 0, 1e-3]}
    joint = {"type": "revolute", "axis": "y", "inboard": "ground", "outboard": "top", "start": {"q": 0.0}}
    scene = {"schema": 1, "gravity": [0, 0, -9.81], "bodies": {"top": body}, "joints": {"pivot": joint}}
    asked = ["joints.pivot.start.q"], ["pivot.q[1]"]
    rate = math.sqrt(9.81 * 1e-3 / (1e-6 + 1e-9))
    found = trunnion.sensitivity(scene, *asked, 0.1, 0.1).derivatives[-1].item()
    assert found == pytest.approx(math.cosh(0.1 * rate), rel=1e-3)
    with pytest.raises(SimulationError, match="grow without bound"):
        trunnion.sensitivity(scene, *asked, 8.0, 8.0)
