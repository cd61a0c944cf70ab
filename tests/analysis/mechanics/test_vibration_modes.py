"""Small oscillations about rest agree with closed forms: chains, springs and dampers, and joints held by friction."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.polynomial.laguerre import lagroots

from tests.analysis.mechanics.point_mass_chain import GRAVITY, LENGTH, chain
from tests.default_case_selection import sampled
from tests.reference.scenes.random_device_scenes import crossed
from trunnion import SimulationError, modes, simulate
from trunnion.analysis.mechanics.vibration_modes import displaced
from trunnion.cli import main
from trunnion.scene.data_classes import scene as sm

CLOSE = 1e-8


def hung(n: int) -> np.ndarray:
    """Frequencies, Hz, of n equal masses hung on equal rods: ω² = (g/L) times the roots of Laguerre's polynomial of degree n."""
    return np.sqrt(GRAVITY / LENGTH * lagroots([0.0] * n + [1.0])) / (2 * np.pi)


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("n", [1, 2, 10])
@pytest.mark.parametrize("start", [0.0, 0.3])
def test_a_hanging_chain_has_the_frequencies_of_laguerres_polynomial(n: int, start: float) -> None:
    found = modes(chain(n, start))
    assert [m.frequency for m in found.modes] == pytest.approx(sorted(hung(n)), rel=CLOSE)
    assert [m.damping for m in found.modes] == pytest.approx(np.zeros(n), abs=1e-9)


def test_shapes_are_those_of_the_double_pendulum() -> None:
    """Relative angles of the two modes: (1, √2 − 1) and (1, −√2 − 1), the largest being 1."""
    slow, fast = modes(chain(2)).modes
    root = np.sqrt(2.0)
    assert slow.shape["j1.qd[1]"] / slow.shape["j0.qd[1]"] == pytest.approx(root - 1, rel=CLOSE)
    assert fast.shape["j1.qd[1]"] / fast.shape["j0.qd[1]"] == pytest.approx(-root - 1, rel=CLOSE)
    for m in (slow, fast):
        assert max(abs(x) for x in m.shape.values()) == pytest.approx(1.0)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("damping", [0.0, 3.0, 200.0])
def test_a_damped_spring_has_its_two_rates(damping: float) -> None:
    mass, stiffness = 3.0, 500.0
    body = sm.Body(box=(0.1, 0.1, 0.1), mass=mass)
    guide = sm.Joint("prismatic", "ground", "block", axis="z", spring=sm.Spring(stiffness), damping=damping)
    found = modes(sm.Scene({"block": body}, {"guide": guide}, "hung"))
    exact = np.roots([mass, damping, stiffness])
    if abs(exact[0].imag) > 0:
        [m] = found.modes
        assert (m.frequency, m.rate) == (
            pytest.approx(abs(exact[0].imag) / (2 * np.pi), rel=CLOSE), pytest.approx(exact[0].real, abs=CLOSE),
        )  # fmt: skip
        assert m.damping == pytest.approx(damping / (2 * np.sqrt(stiffness * mass)), abs=CLOSE)
    else:
        assert sorted(m.rate for m in found.modes) == pytest.approx(sorted(exact), rel=CLOSE)


def test_a_joint_that_friction_holds_leaves_the_swing_of_the_rest() -> None:
    rub = sm.Friction(mu=0.5, radius=0.1, half_length=0.1)
    scene = chain(2, rub={0: rub})
    [held] = modes(scene, stick=True).modes
    assert held.frequency == pytest.approx(np.sqrt(GRAVITY / LENGTH) / (2 * np.pi), rel=CLOSE)
    assert held.shape["j0.qd[1]"] == pytest.approx(0.0, abs=1e-12)
    assert [m.frequency for m in modes(scene).modes] == pytest.approx(sorted(hung(2)), rel=CLOSE)


@pytest.mark.parametrize(("seed", "joint"), sampled([(s, j) for s in (0, 1) for j in ("j1", "j2", "j3")], 1))
def test_friction_in_a_cut_joint_holds_it_as_a_stiff_spring_does(seed: int, joint: str) -> None:
    """The spring's stiffness is 1e7 N m per radian. Its compliance changes the frequency by about one part in 1e7."""
    scene = crossed("five_bars", seed)
    rub = sm.Friction(torque=0.1)
    joints = {n: replace(j, friction=rub if n == joint else None, cut=n == joint or None) for n, j in scene.joints.items()}
    [held] = (found := modes(replace(scene, joints=joints), stick=True)).modes
    assert found.held == (joint,)
    rest = simulate(found.scene, until=1e-6, every=1e-6)[f"{joint}.q[1]"][0]
    sprung = replace(found.scene.joints[joint], friction=None, spring=sm.Spring(1e7, rest=float(rest)))
    slow, fast = modes(replace(found.scene, joints=found.scene.joints | {joint: sprung}), at_start=True).modes
    assert slow.frequency == pytest.approx(held.frequency, rel=1e-6)
    assert fast.frequency > 1e3 * slow.frequency


def test_a_loop_swings_as_a_run_of_it_does() -> None:
    """The test compares a linkage's frequency with the period of a small oscillation in a simulation."""
    found = modes("crank_slider_free")
    scene = displaced(found, 0, 1e-4)
    joints = {n: replace(j, friction=None) for n, j in scene.joints.items()}
    [mode] = found.modes
    largest = max(mode.shape, key=lambda n: abs(mode.shape[n])).replace(".qd", ".q")
    r = simulate(replace(scene, joints=joints), until=3.2 / mode.frequency, every=0.001 / mode.frequency, rtol=1e-11)
    q = r[largest] - found.q[largest.split(".")[0]][0]
    crossings = np.flatnonzero(np.diff(np.sign(q)))
    times = [r.time[i] - q[i] * (r.time[i + 1] - r.time[i]) / (q[i + 1] - q[i]) for i in crossings]
    assert 1.0 / np.diff(times[::2]) == pytest.approx(np.full(len(times[::2]) - 1, mode.frequency), rel=1e-7)


def test_a_start_that_is_not_at_rest_is_reported() -> None:
    with pytest.raises(SimulationError, match="not a pose of rest"):
        modes(chain(2, 0.3), at_start=True)


@pytest.mark.slow
def test_the_command_prints_and_draws_the_modes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    picture = tmp_path / "modes.png"
    assert main(["modes", "double_pendulum", "--json", "--plot", str(picture)]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [round(m["frequency"], 6) for m in told["modes"]] == [
        round(m.frequency, 6) for m in modes("double_pendulum").modes
    ]
    assert picture.stat().st_size > 10_000
    assert main(["equilibrium", "spherical_pendulum"]) == 0
    assert "friction holds each coordinate" in capsys.readouterr().out
