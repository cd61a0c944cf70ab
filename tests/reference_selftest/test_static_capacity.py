"""The capacity of a shaft or sleeve at rest is its friction at the static coefficient (theory, "Rest"). For every load, friction
grows with the coefficient, as long as the arm of axial friction times the coefficient is below the half length."""

import numpy as np
import pytest

from tests.reference.contact_and_friction.contact_roots import journal, sleeve
from tests.reference.contact_and_friction.friction_laws import Law

MOST = 1.5
"""Largest coefficient of friction that is tried."""


def shaft_friction(fc, mc, way: float, radius: float, half_length: float, mu: float) -> float:
    """Friction force at the surface of a shaft that slides in the direction ``way`` (0: along its axis, π/2: around it)."""
    out = journal(fc, mc, np.sin(way) / radius, np.cos(way), radius, half_length, Law("coulomb", mu))
    return float(np.hypot(out.force, out.torque / radius))


def loads(seed: int):
    """(force, moment, generator): a force of size 1 and a moment of any size, from small to dominant."""
    rng = np.random.default_rng(seed)
    return rng.normal(size=3), rng.normal(size=3) * 10 ** rng.uniform(-2, 1.5), rng


@pytest.mark.default_cases(18)
@pytest.mark.parametrize("seed", range(60))
def test_a_shafts_friction_grows_with_the_coefficient(seed: int) -> None:
    fc, mc, rng = loads(seed)
    radius, half_length, way = 10 ** rng.uniform(-2, 0), 0.3, rng.uniform(0, 2 * np.pi)
    mus = np.linspace(1e-3, min(MOST, half_length / radius), 60)
    held = [shaft_friction(fc, mc, way, radius, half_length, mu) for mu in mus]
    assert np.all(np.diff(held) > -1e-12 * max(held))


@pytest.mark.default_cases(13)
@pytest.mark.parametrize("seed", range(60))
def test_a_sleeves_friction_grows_with_the_coefficient(seed: int) -> None:
    fc, mc, rng = loads(seed)
    (width, height), half_length = 10 ** rng.uniform(-2, 0, 2), 0.3
    mus = np.linspace(1e-3, min(MOST, half_length / max(width, height)), 60)
    held = [abs(sleeve(fc, mc, 1.0, width, height, half_length, Law("coulomb", mu)).force) for mu in mus]
    assert np.all(np.diff(held) > -1e-12 * max(held))


def test_a_longer_friction_arm_may_hold_a_load_better_with_less_friction() -> None:
    """The radius is twice the half length. The lever arm of the friction itself moves load away from the ends."""
    fc, mc = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.2])
    held = [abs(shaft_friction(fc, mc, 0.0, 0.6, 0.3, mu)) for mu in (0.9, 1.3)]
    assert held[1] < held[0]
