"""Finished runs obey the laws. Only friction takes energy, and every slip is found. Results do not depend on method or
tolerance."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from tests.reference.scenes.random_friction_scenes import rubbing
from tests.reference.scenes.random_streams import stream
from trunnion.scene import load_scene, scene_from_dict
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate
from trunnion.system.construction.start_values_and_scales import length_scale, rate_scale

METHODS = ("auto", "rk5", "rk8", "rosenbrock")
LIMIT = 1e-7
"""Value of v_eps, m/s, with which the regularised law differs from Coulomb's by 1e-7 of the motion at 1 m/s."""


def energy_error(r: Result) -> float:
    """Largest residual of the energy, relative to the energy converted."""
    turned = np.ptp(r["energy.kinetic"]) + np.ptp(r["energy.potential"]) + r["energy.dissipated"][-1]
    return float(np.abs(r["energy.residual"]).max() / turned)


def without_stick(scene: sm.Scene) -> sm.Scene:
    """The scene with the regularised law. A pair then creeps instead of sticking; the motion tends to the motion by Coulomb's
    law."""
    return replace(scene, friction=replace(scene.friction, law="regularized", v_eps=LIMIT))


SHAKEN = {"amplitude": 0.6, "frequency": 40.0, "phase": 0.3}
SHAKERS = {
    "a motor's signal": {"motor": {"stall": 1.0, "no_load": 1e9, "signal": {"harmonic": SHAKEN | {"offset": 0.41}}},
                         "friction": {"force": 1.0}},
    "a friction force": {"effort": 1.0, "friction": {"force": {"harmonic": SHAKEN | {"offset": 1.595}}}},
}  # fmt: skip


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("shaker", SHAKERS)
def test_a_block_slips_once_in_every_period_of_whatever_signal_frees_it(shaker: str, method: str) -> None:
    """The applied force exceeds friction during 5 % of each period, or less."""
    joint = {"type": "prismatic", "axis": "x", "inboard": "ground", "outboard": "b"} | SHAKERS[shaker]
    bodies = {"b": {"mass": 1, "inertia": [0.01] * 3}}
    scene = scene_from_dict({"gravity": [0, 0, 0], "bodies": bodies, "joints": {"p": joint}})
    for rtol in (1e-3, 1e-6):
        r = simulate(scene, until=1.0, method=method, rtol=rtol)
        assert sum(e.kind == "slip" for e in r.events) == 40, rtol


# -- joints that cannot both rest ------------------------------------------------------------------------------------------------


def trammel(seed: int) -> sm.Scene:
    """Two sliders in series, a rod, and a slider across them. The second slider reverses where the rod is perpendicular to the
    slider, while the first slider rests. The two sliders cannot rest together."""
    rng = stream("trammel", seed)
    rod, travel, mu = float(rng.uniform(0.6, 1.5)), float(rng.uniform(0.2, 0.5)), float(rng.uniform(0.5, 0.9))
    lean = math.asin(travel / rod)

    def slider(coefficient: float) -> sm.Friction:
        return sm.Friction(mu=coefficient, half_width=0.02, half_height=0.02, half_length=float(rng.uniform(0.3, 0.6)))

    block = {"mass": float(rng.uniform(0.5, 2.0)), "inertia": (0.05, 0.05, 0.05)}
    bodies = {
        "first": sm.Body(**block),
        "second": sm.Body(**block),
        "rod": sm.Body(mass=0.5, inertia=(0.01, 0.05, 0.05), points={"p": (-rod / 2, 0.0, 0.0), "q": (rod / 2, 0.0, 0.0)}),
        "across": sm.Body(**block),
    }
    turn = sm.AxisAngle((0.0, 0.0, 1.0), math.pi + lean)
    joints = {
        "ground_first": sm.Joint("prismatic", "ground", "first", axis="x", pin="outboard", friction=slider(mu)),
        "first_second": sm.Joint("prismatic", "first", "second", axis="x", pin="outboard", friction=slider(0.1 * mu),
                                 start=sm.Start(q=rod * math.cos(lean))),
        "ball": sm.Joint("spherical", "second", "rod.p", start=sm.Start(q=turn)),
        "pin": sm.Joint("universal", sm.Side("rod", "q", axis="z", reference="x"), sm.Side("across", axis="z", reference="x")),
        "guide": sm.Joint("prismatic", "ground", "across", axis="y", reference="z", start=sm.Start(q=-travel, qd=1.0)),
    }  # fmt: skip
    return sm.Scene(bodies, joints, f"trammel {seed}", gravity=(0.0, 0.0, -float(rng.choice([1e-4, 1.0, 9.81]))))


COSTLY = partial(pytest.param, marks=pytest.mark.slow)
"""A seed whose Jacobian takes the compiler three to four seconds; it belongs to the slow tests."""


@pytest.mark.slow
@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", range(4))
def test_two_sliders_in_series_do_not_both_stop_at_a_dead_centre(seed: int) -> None:
    scene = trammel(seed)
    creeping = simulate(without_stick(scene), until=0.8, every=0.8, rtol=1e-8)
    for method in METHODS:
        for rtol in (1e-4, 1e-8):
            r = simulate(scene, until=0.8, every=0.02, method=method, rtol=rtol)
            assert r.outcome.ok
            assert energy_error(r) <= 10 * rtol  # energies are sums of squared velocities with relative errors of about rtol
            assert r["guide.qd[1]"][-1] == pytest.approx(creeping["guide.qd[1]"][-1], abs=10 * rtol + 10 * LIMIT)


# -- every slip ------------------------------------------------------------------------------------------------------------------


def ratchet(duty: float, seed: int = 0) -> sm.Scene:
    """A block on a rough table. In each period of 1 s, a force pushes the block for the share ``duty`` of the period. The force
    acts in one direction and exceeds the static friction."""
    rng = stream("ratchet", duty, seed)
    mass, mu, swing = float(rng.uniform(0.5, 5.0)), float(rng.uniform(0.1, 0.6)), float(rng.uniform(0.3, 0.95))
    most = mu * mass * 9.81
    offset, phase = most * (1 - swing * math.cos(math.pi * duty)), float(rng.uniform(0, 6))
    push = sm.Harmonic(amplitude=swing * most, frequency=1.0, phase=phase, offset=offset)
    rub = sm.Friction(mu=mu, half_width=0.01, half_height=0.01, half_length=0.5)
    slide = sm.Joint("prismatic", "ground", "block", axis="x", pin="outboard", friction=rub, effort=sm.Signal(harmonic=push))
    return sm.Scene({"block": sm.Body(mass=mass, inertia=(0.1, 0.1, 0.1))}, {"slide": slide}, gravity=(0.0, 0.0, -9.81))


def slips_in_every_period(duty: float, seed: int, method: str, rtol: float, periods: int) -> None:
    """Run the scene. Once in each period the load exceeds the friction that holds the block."""
    r = simulate(ratchet(duty, seed), until=float(periods), every=float(periods), method=method, rtol=rtol)
    slips = [e.time for e in r.events if e.kind == "slip"]
    assert len(slips) in (periods - 1, periods), (method, rtol)  # the first and the last period of the run may contain no slip
    assert np.diff(slips) == pytest.approx(np.ones(len(slips) - 1), abs=1e-9 + 100 * rtol * duty)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("duty", [0.01, 0.05, 0.2, 0.3, 0.45, 0.49, 0.499])
def test_a_block_slips_once_in_every_period_at_every_tolerance(duty: float) -> None:
    for method in METHODS:
        for rtol in (1e-4, 1e-6, 1e-9):
            slips_in_every_period(duty, 0, method, rtol, 100)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("duty", [0.01, 0.05, 0.1, 0.2, 0.3, 0.4, 0.45, 0.49, 0.499, 0.4999])
def test_a_block_slips_once_in_every_one_of_1000_periods_at_every_setting(duty: float, seed: int) -> None:
    """The force acts for exactly half of each period. At every setting, the block then does not rest: its speed falls to zero and
    rises at once."""
    for method in METHODS:
        for rtol in (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9):
            slips_in_every_period(duty, seed, method, rtol, 1000)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", range(2))
def test_a_block_that_rests_for_an_instant_only_slips_in_every_one_of_1000_periods(seed: int) -> None:
    """The force acts for 49.9 % of each period. The block then rests for a thirtieth of a period. Its speed reaches zero between
    two stages of a step."""
    for rtol in (1e-4, 1e-6):
        slips_in_every_period(0.499, seed, "rk5", rtol, 1000)


# -- rest --------------------------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_pair_held_at_a_dead_centre_does_not_end_a_run() -> None:
    """A driven crank, a rod on a ball joint and a universal joint, and a slider on a cylindrical guide. At both dead centres the
    universal joint's second axis is held and does not move. Every method finds one reversal in each half turn."""
    steel = {"density": 7801.0}
    bodies = {
        "crank": sm.Body(box=(0.5, 0.1, 0.1), points={"i": (-0.25, 0.0, 0.0), "o": (0.25, 0.0, 0.0)}, **steel),
        "rod": sm.Body(box=(1.0, 0.1, 0.1), points={"i": (-0.5, 0.0, 0.0), "o": (0.5, 0.0, 0.0)}, **steel),
        "slider": sm.Body(box=(0.2, 0.2, 0.2), **steel),
    }
    joints = {
        "crank": sm.Joint("revolute", "ground", "crank.i", axis=(0.0, -1.0, 0.0), reference="z",
                          drive=sm.Drive(constant=sm.Constant(rate=10.0, start=0.3))),
        "pin": sm.Joint("spherical", "crank.o", "rod.i"),
        "cross": sm.Joint("universal", "rod.o", "slider", axis=(0.0, -1.0, 0.0), reference="z",
                          friction=sm.Friction(mu=0.2, radius=(0.02, 0.02), half_length=(0.05, 0.05))),
        "guide": sm.Joint("cylindrical", "ground", "slider", axis="x", reference="y", pin="outboard", start=sm.Start(q=(1.4, 0.0)),
                          friction=sm.Friction(mu=0.2, radius=0.03, half_length=0.15)),
    }  # fmt: skip
    joints = {("turn" if n == "crank" else n): j for n, j in joints.items()}
    scene = sm.Scene(bodies, joints, gravity=(0.0, 0.0, -9.81))
    half = math.pi / 10.0
    for method in METHODS:
        for rtol in (1e-4, 1e-6, 1e-9):
            r = simulate(scene, until=2.0, every=0.1, method=method, rtol=rtol)
            assert r.outcome.ok, (method, rtol)
            turns = [e.time for e in r.events if e.kind == "reversal" and e.joint == "guide"]
            dead = [(math.pi - 0.3) / 10.0 + k * half for k in range(6)]
            assert turns == pytest.approx(dead, abs=100 * rtol)


# -- random mechanisms ------------------------------------------------------------------------------------------------------------

SETTINGS = (("rk5", 1e-5), ("auto", 1e-6), ("rosenbrock", 1e-6))


def obeys(kind: str, seed: int) -> None:
    """A random mechanism of any size with friction in every joint. Finished runs have lost energy only to friction. All settings
    end alike."""
    scene = rubbing(kind, seed).scene
    span = 3.0 / rate_scale(scene, np.zeros(1), length_scale(scene))
    ends = []
    for method, rtol in SETTINGS:
        r = simulate(scene, until=span, every=span / 20, method=method, rtol=rtol, max_steps=40000, outputs=["energy.*"])
        ends.append(r.outcome.name)
        if r.outcome.ok and len(r.time):
            assert energy_error(r) <= 1e-3, (method, rtol)  # the bound of correct runs; the errors of most runs are about rtol
    assert len(set(ends)) == 1, ends


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", [0, 1, COSTLY(2), 3])
def test_random_trees_lose_energy_to_friction_alone(seed: int) -> None:
    obeys("tree", seed)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", [COSTLY(1), 2, 4])
def test_random_loops_lose_energy_to_friction_alone(seed: int) -> None:
    obeys("loop", seed)


# -- along a line ----------------------------------------------------------------------------------------------------------------


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("rtol", [1e-6, 1e-8])
def test_a_pair_of_several_components_that_reverses_along_a_line_stays_on_it_at_every_row(rtol: float) -> None:
    """The double pendulum finally swings in a plane: its guide turns and does not travel. Just after a reversal, friction across
    the line of sliding is very stiff. Stages of the dense output must not amplify round-off across this line."""
    scene = load_scene("double_pendulum")
    scene = replace(scene, friction=replace(scene.friction, law="coulomb", normal_force="adams"))
    r = simulate(scene, until=31.0, every=0.005, rtol=rtol, outputs=["guide.qd*", "guide.reaction.torque[3]"])
    assert r.outcome.ok
    late = r.time > 30.0
    assert np.abs(r["guide.qd[1]"][late]).max() <= 1e-9 * np.abs(r["guide.qd[2]"][late]).max()
    assert np.abs(np.diff(r["guide.reaction.torque[3]"][late])).max() <= 1.0  # N m
