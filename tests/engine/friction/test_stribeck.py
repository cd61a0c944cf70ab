"""Stribeck's law: the coefficient falls with speed from static to kinetic friction, and is smooth within a step. If static and
kinetic friction are equal, the law is Coulomb's law."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.engine.checks.contact_functions import ELEMENTS, States, evaluated, random_states
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import simulate

FORMS = list(product(ELEMENTS, (False, True), (1, -1)))


def levels(s: States) -> np.ndarray:
    """Coefficient of dry friction of balls, as a function of the component of their speed across the load."""
    mu, static, v_stribeck = (s.number(name) for name in ("mu", "mu_static", "v_stribeck"))
    across = np.linalg.norm(np.cross(s.rates.T, s.wrench.T[:, :3]), axis=1) / np.linalg.norm(s.wrench[:3], axis=0)
    return mu + (static - mu) * np.exp(-((s.number("radius") * across / v_stribeck) ** 2))


def outside_the_cone(s: States, margin: float) -> np.ndarray:
    """For each state, true if the ball slides: the angle between angular velocity and load exceeds the friction angle."""
    along = np.abs(np.sum(s.wrench[:3] * s.rates, axis=0))
    return np.linalg.norm(np.cross(s.rates.T, s.wrench.T[:, :3]), axis=1) > (levels(s) + margin) * along


@pytest.mark.default_cases(4)
@pytest.mark.parametrize(("element", "adams", "pin"), FORMS)
def test_friction_never_gives_energy(element: str, adams: bool, pin: int) -> None:
    s = random_states(element, "stribeck", 2000)
    friction, derivative, contacts = evaluated(s, adams, pin)
    power = -np.sum(friction * s.rates, axis=0)
    assert np.all(power <= 1e-14 * np.sum(np.abs(friction * s.rates), axis=0))
    sliding = np.full(2000, True) if element != "ball" or adams else outside_the_cone(s, 1e-6)
    assert np.all(power[sliding] < 0)
    assert np.count_nonzero(sliding) > 1000
    assert np.all(np.isfinite(derivative))
    assert np.all(np.isfinite(contacts))


@pytest.mark.default_cases(11)
@pytest.mark.parametrize(("element", "adams", "pin"), FORMS)
@pytest.mark.parametrize("equal", ["fast", "slow"])
def test_the_law_is_coulombs_with_kinetic_friction_when_fast_and_static_friction_when_slow(
    element: str, adams: bool, pin: int, equal: str
) -> None:
    """Limits of the law. v_stribeck is far below or far above the sliding speed, without viscous friction."""
    s, names = random_states(element, "stribeck", 300), ("mu", "mu_static", "v_stribeck", "viscosity")
    first = len(s.numbers) - len(names)
    s.numbers[first + 2], s.numbers[first + 3] = (1e-9 if equal == "fast" else 1e9), 0.0
    mu = s.numbers[first + (0 if equal == "fast" else 1)]
    c = random_states(element, "coulomb", 300)
    c = type(c)(element, "coulomb", s.wrench, s.rates, np.vstack([s.numbers[:first], mu]))
    mine, theirs = evaluated(s, adams, pin), evaluated(c, adams, pin)
    for a, b in zip(mine, theirs, strict=True):
        assert np.abs(a - b).max() <= 1e-12 * np.abs(b).max()


@pytest.mark.parametrize("pin", [1, -1])
def test_the_contact_of_a_ball_slides_with_the_ratio_the_law_has_at_the_speed_across_its_load(pin: int) -> None:
    """The test does not use the closed form. It solves f_c = f_n (κ ω̂ × n − n) for n. The ratio is the tangential force over the
    normal force at n."""
    s = random_states("ball", "stribeck", 300, seed=2)
    _, _, contacts = evaluated(s, False, pin)
    get, level, slides = s.number, levels(s), outside_the_cone(s, 1e-3)
    assert np.count_nonzero(slides) > 100
    for i in np.flatnonzero(slides):
        fn, n = contacts[0, i], contacts[1:4, i] / np.linalg.norm(contacts[1:4, i])
        f, omega = s.wrench[:3, i], pin * s.rates[:, i]
        slip = np.cross(omega, n)
        ratio = level[i] + get("viscosity")[i] * get("radius")[i] * np.linalg.norm(slip)
        assert np.abs(f - fn * (ratio * slip / np.linalg.norm(slip) - n)).max() <= 1e-9 * np.abs(f).max()


def test_stribecks_law_with_one_coefficient_stops_at_the_times_of_coulombs_law() -> None:
    stops = [[e.time for e in swing(law).events] for law in ("coulomb", "stribeck")]
    assert len(stops[0]) >= 10
    assert stops[1] == pytest.approx(stops[0], abs=1e-9)  # both runs solve the same equations with the same steps


def swing(law: str, ratio: float = 1.0):
    """A run of example 8.1's block, which falls from the horizontal about a ball and comes to rest."""
    rub = sm.Friction(mu=0.6, mu_static=0.6 * ratio, radius=0.05, law=law, v_stribeck=1e-3)
    joint = sm.Joint("spherical", "ground", "block", friction=rub, start=sm.Start(sm.AxisAngle("z", np.pi / 2)))
    block = sm.Body(box=(0.1, 1.0, 0.1), mass=78.0, center=(0.0, -0.5, 0.0))
    scene = sm.Scene({"block": block}, {"ball": joint}, "swing", gravity=(0.0, -9.81, 0.0))
    return simulate(scene, until=12.0, every=0.1, rtol=1e-10)


@pytest.mark.parametrize("v_stribeck", [1e-5, 1e-1])
def test_a_block_holds_up_to_static_friction_and_not_beyond(v_stribeck: float) -> None:
    """A block on an incline whose angle is just below and just above atan μ_static."""
    for over, moves in ((-1e-7, False), (1e-7, True)):
        tilt = np.arctan(0.5) + over
        rub = sm.Friction(
            mu=0.3, mu_static=0.5, law="stribeck", v_stribeck=v_stribeck, half_length=1.0, half_width=0.05, half_height=0.05
        )
        joint = sm.Joint("prismatic", "ground", "block", axis="x", pin="outboard", friction=rub)
        g = (9.81 * np.sin(tilt), 0.0, -9.81 * np.cos(tilt))
        scene = sm.Scene({"block": sm.Body(mass=1.0, inertia=(1.0, 1.0, 1.0))}, {"slide": joint}, "incline", gravity=g)
        r = simulate(scene, until=60.0, every=1.0, rtol=1e-9)
        assert (np.abs(r["slide.q[1]"]) > 0).any() == moves


def test_steady_sliding_balances_the_law() -> None:
    """On an incline, with a viscous part, the block moves at the speed at which friction balances the weight."""
    rub = sm.Friction(
        mu=0.3, mu_static=0.5, law="stribeck", v_stribeck=0.05, viscosity=0.4, half_length=1.0, half_width=0.05, half_height=0.05
    )
    joint = sm.Joint("prismatic", "ground", "block", axis="x", pin="outboard", friction=rub, start=sm.Start(0.0, 1.0))
    g = (9.81 * np.sin(0.4), 0.0, -9.81 * np.cos(0.4))
    scene = sm.Scene({"block": sm.Body(mass=1.0, inertia=(1.0, 1.0, 1.0))}, {"slide": joint}, "incline", gravity=g)
    r = simulate(scene, until=20.0, every=1.0, rtol=1e-9)
    speed = brentq(lambda v: 0.3 + 0.2 * np.exp(-((v / 0.05) ** 2)) + 0.4 * v - np.tan(0.4), 0.2, 2.0, xtol=1e-14)
    assert r["slide.qd[1]"][-1] == pytest.approx(speed, abs=1e-9)
