"""Mass properties of solid shapes equal sums over many small cells. Explicit mass properties are taken as given."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from trunnion.scene.data_classes.scene import Body, Cylinder
from trunnion.scene.queries.mass_properties import mass_properties, matrix, principal_moments

SIZE = st.floats(0.01, 10)


def midpoints(low: float, high: float, n: int) -> np.ndarray:
    """Centres of n equal intervals."""
    return low + (np.arange(n) + 0.5) * (high - low) / n


def summed(x, y, z, weight) -> tuple[float, np.ndarray]:
    """Volume and inertia for unit density, summed over cells at x, y, z with their volumes."""
    p = np.stack([np.broadcast_to(a, weight.shape) for a in (x, y, z)])
    inertia = np.eye(3) * np.sum(weight * (p**2).sum(0)) - np.einsum("iabc,jabc,abc->ij", p, p, weight)
    return float(weight.sum()), inertia


def test_a_box_is_the_sum_of_its_cells():
    n, (a, b, c) = 40, (1.0, 0.3, 0.2)
    x, y, z = np.meshgrid(*(midpoints(-s / 2, s / 2, n) for s in (a, b, c)), indexing="ij")
    volume, inertia = summed(x, y, z, np.full(x.shape, a * b * c / n**3))
    m, center, found = mass_properties(Body(box=(a, b, c), density=2.0, center=(1, 2, 3)))
    assert (m, center) == (pytest.approx(2 * volume), (1, 2, 3))
    # cells of 1/40 of the box cause errors of 1/40² in each moment
    np.testing.assert_allclose(found, 2 * inertia, rtol=1e-3, atol=1e-12)


@pytest.mark.parametrize("axis", ["x", "y", "z", "-x"])
def test_a_cylinder_is_the_sum_of_its_cells(axis):
    n, r, h = 60, 0.4, 1.1
    rho, phi, s = np.meshgrid(midpoints(0, r, n), midpoints(0, 2 * math.pi, n), midpoints(-h / 2, h / 2, n), indexing="ij")
    weight = rho * (r / n) * (2 * math.pi / n) * (h / n)
    parts = {axis[-1]: s}
    across = [a for a in "xyz" if a != axis[-1]]
    parts |= {across[0]: rho * np.cos(phi), across[1]: rho * np.sin(phi)}
    volume, inertia = summed(parts["x"], parts["y"], parts["z"], weight)
    m, _, found = mass_properties(Body(cylinder=Cylinder(r, h, axis), mass=3.0))
    assert m == 3.0
    np.testing.assert_allclose(found, 3.0 / volume * inertia, rtol=1e-3, atol=1e-12)


def test_a_ball_is_the_sum_of_its_cells():
    n, r = 60, 0.7
    rho, phi, u = np.meshgrid(midpoints(0, r, n), midpoints(0, 2 * math.pi, n), midpoints(-1, 1, n), indexing="ij")
    weight = rho**2 * (r / n) * (2 * math.pi / n) * (2 / n)
    side = rho * np.sqrt(1 - u**2)
    volume, inertia = summed(side * np.cos(phi), side * np.sin(phi), rho * u, weight)
    m, _, found = mass_properties(Body(sphere=r, density=5.0))
    assert m == pytest.approx(5 * volume, rel=1e-3)
    np.testing.assert_allclose(found, 5.0 * inertia, rtol=2e-3, atol=1e-12)


@given(SIZE, SIZE, SIZE, st.floats(1, 1e4))
def test_mass_and_density_give_the_same_body(a, b, c, density):
    m, _, one = mass_properties(Body(box=(a, b, c), density=density))
    _, _, two = mass_properties(Body(box=(a, b, c), mass=m))
    np.testing.assert_allclose(one, two, rtol=1e-14)


def test_the_papers_block_has_the_papers_numbers():
    m, _, inertia = mass_properties(Body(box=(1, 0.1, 0.1), density=7800))
    assert m == pytest.approx(78, rel=1e-14)
    assert inertia[1][1] + m * 0.25 == pytest.approx(26.065, rel=1e-14)  # moment of inertia about the end face (F1)


def test_an_explicit_inertia_wins_over_the_shape():
    body = Body(box=(1, 1, 1), mass=2, inertia=(1, 2, 2.5, 0.1, 0.2, 0.3))
    assert mass_properties(body)[2] == ((1, 0.1, 0.2), (0.1, 2, 0.3), (0.2, 0.3, 2.5))
    assert matrix((1, 2, 3)) == ((1, 0, 0), (0, 2, 0), (0, 0, 3))


def test_zeros_stay_exact_zeros():
    _, _, inertia = mass_properties(Body(cylinder=Cylinder(0.1, 1.0), mass=1))
    assert [inertia[i][j] for i in range(3) for j in range(3) if i != j] == [0.0] * 6


def whole(x: float) -> float:
    """The number, or 0 if its square is too small for the reference. (LAPACK's eigenvalues are wrong by 3e-4 for a matrix with the
    entries 1e-128 and 3.)"""
    return x if abs(x) > 1e-100 else 0.0


@given(st.lists(st.floats(-10, 10).map(whole), min_size=6, max_size=6))
@example([9.8e-215, 3.2e-96, 0.0, 3.0, 0.0, 0.0])
def test_principal_moments_are_the_eigenvalues(six):
    m = matrix(tuple(six))
    np.testing.assert_allclose(principal_moments(m), np.linalg.eigvalsh(np.array(m)), rtol=1e-12, atol=1e-12)


def test_a_body_that_was_not_checked_is_refused():
    for body in (Body(), Body(box=(1, 1, 1)), Body(inertia=(1, 1, 1)), Body(mass=1)):
        with pytest.raises(ValueError, match="needs"):
            mass_properties(body)
