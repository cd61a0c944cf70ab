"""Derivatives of runs with respect to the numbers of signals: values, parameters of formulas, and times at which a load jumps."""

from __future__ import annotations

import numpy as np
import pytest

import trunnion
from tests.analysis.sensitivities.test_derivatives_along_runs import ACROSS, differences
from tests.default_case_selection import sampled
from tests.engine.devices.test_signals import KINDS, G, load, numbers, scene
from trunnion.scene.overrides import list_parameters
from trunnion.scene.scene_loader import scene_from_dict

EFFORT = "joints.slide.effort"
UNTIL = 2.0
CASES = [(kind, seed) for kind in KINDS if kind != "limited table" for seed in range(3)]


def derivatives(keys: dict, names: list[str], mu: float = 0.0, **parameters: str) -> np.ndarray:
    """Derivatives of coordinate and rate at the end (2 × names) of a mass of 2 kg."""
    data = scene(keys, 2.0, mu=mu) | ({"parameters": parameters} if parameters else {})
    given = [n if n.startswith("parameters") else f"{EFFORT}.{n}" for n in names]
    s = trunnion.sensitivity(scene_from_dict(data), given, ["slide.q[1]", "slide.qd[1]"], UNTIL, UNTIL)
    return np.asarray(s.derivatives[-1])


def test_the_time_of_a_jump_moves_the_whole_motion_after_it() -> None:
    for mu, held in ((0.0, 0.0), (0.3, 0.3 * 2.0 * G)):  # with friction, the block sticks until the jump
        a, left = (8.0 - held) / 2.0, UNTIL - 0.75
        found = derivatives({"step": {"end": 8.0, "begin": 0.75}}, ["step.begin", "step.end"], mu)
        assert found == pytest.approx(np.array([[-a * left, 0.5 * left**2 / 2.0], [-a, left / 2.0]]), rel=1e-9)


def test_the_period_of_pulses_moves_each_pulse_by_its_number() -> None:
    peak, begin, duration, period = 3.0, 0.25, 0.125, 0.5
    keys = {"pulse": {"peak": peak, "begin": begin, "duration": duration, "period": period}}
    found = derivatives(keys, [f"pulse.{n}" for n in ("period", "begin", "duration", "peak")])
    k = np.arange(4)
    left = UNTIL - begin - k * period - duration
    a = peak / 2.0
    place = [(-k * a * duration).sum(), (-a * duration * k**0).sum(), (a * left).sum(),
             (duration * (left + duration / 2) / 2.0).sum()]  # fmt: skip
    assert found == pytest.approx(np.array([place, [0.0, 0.0, 4 * a, 4 * duration / 2.0]]), rel=1e-9, abs=1e-12)


def test_a_formula_has_derivatives_by_its_parameters_and_constants() -> None:
    force, w, tau = 2.0, 3.0, 0.5
    names = ["parameters.F", "parameters.w", "parameters.T", "expression.numbers[2]"]
    found = derivatives({"expression": "F*sin(w*t)*exp(-t/T)"}, names, F="2 N", w="3 rad/s", T="0.5 s")[1]
    t, weights = np.polynomial.legendre.leggauss(40)
    t, weights = 0.5 * UNTIL * (t + 1), 0.5 * UNTIL * weights / 2.0
    fades = np.exp(-t / tau)
    by_w = weights @ (force * t * np.cos(w * t) * fades)
    by_tau = weights @ (force * np.sin(w * t) * fades * t / tau**2)
    assert found == pytest.approx([weights @ (np.sin(w * t) * fades), by_w, by_tau, by_w], rel=1e-8)


@pytest.mark.parametrize(("kind", "seed"), sampled(CASES, [("step", 1)]))
def test_a_rubbing_block_has_the_derivatives_of_differences_by_every_number_of_its_signal(kind: str, seed: int) -> None:
    mass, _, mu = numbers(seed)
    block = scene_from_dict(scene(load(kind, seed, 2.5 * mu * mass * G).keys, mass, mu=mu))
    names = [p.path for p in list_parameters(block) if p.path.startswith(EFFORT) and p.value and ".table." not in p.path]
    found = trunnion.sensitivity(block, names, ["slide.q[1]"], 1.3, 1.3 / 4).derivatives[:, 0]
    for k, name in enumerate(names):
        expected = differences(block, name, ["slide.q[1]"], 1.3, 1.3 / 4)[:, 0]
        assert found[:, k] == pytest.approx(expected, abs=ACROSS * max(np.abs(expected).max(), 1e-6)), name
