"""The contact solvers satisfy the paper's printed equations, corrected by the errata, and dissipate energy."""

import numpy as np
import pytest
from scipy.optimize import fsolve

from tests.reference.contact_and_friction.contact_roots import adams_ball, ball, journal, sleeve
from tests.reference.contact_and_friction.friction_laws import Law

LAWS = [Law("regularized", 0.6, 1e-4), Law("regularized", 0.4, 0.5), Law("viscous", viscosity=0.7), Law("coulomb", 0.3)]


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("seed", range(4))
def test_journal_meets_121_to_126(law, seed):
    rng = np.random.default_rng(seed)
    fc, mc = rng.normal(size=(2, 3))
    omega, sdot, r, c = *rng.normal(size=2), 0.05, 0.2
    out = journal(fc, mc, omega, sdot, r, c, law)
    speed = np.hypot(sdot, r * omega)
    kr, ks = (law.mu_e(speed) * x / speed for x in (r * omega, sdot))
    A = [
        [-kr, -1, -kr, -1],
        [-1, kr, -1, kr],
        [ks * r - c, kr * c, c + ks * r, -kr * c],
        [kr * c, c - ks * r, -kr * c, -ks * r - c],
    ]
    x = [g(k.angle) * k.normal_force for k in out.contacts for g in (np.cos, np.sin)]
    assert np.allclose(A @ np.array(x), [fc[1], fc[2], mc[1], mc[2]], atol=1e-12)
    total = sum(k.normal_force for k in out.contacts)
    assert out.force == pytest.approx(ks * total)
    assert out.torque == pytest.approx(kr * r * total)
    for k in out.contacts:
        assert np.allclose(k.normal, [0, np.sin(k.angle), np.cos(k.angle)])


@pytest.mark.default_cases(8)
@pytest.mark.parametrize("law", LAWS[:3])
@pytest.mark.parametrize("seed", range(4))
def test_ball_meets_105_to_110_and_no_other_start_finds_another_contact(law, seed):
    rng = np.random.default_rng(seed)
    fc, omega, r = rng.normal(size=3), rng.normal(size=3), 0.05

    def equations(x):
        n, fn = x[:3], x[3]
        slip = np.cross(omega, n)
        k = r * law.slope(r * np.linalg.norm(slip))
        return np.r_[fn * (k * slip - n) - fc, n @ n - 1]

    out = ball(fc, omega, r, law)
    (contact,) = out.contacts
    assert np.allclose(equations(np.r_[contact.normal, contact.normal_force]), 0, atol=1e-12)
    slip = np.cross(omega, contact.normal)
    k = r * law.slope(r * np.linalg.norm(slip))
    assert np.allclose(out.torque, r * contact.normal_force * np.cross(contact.normal, k * slip), atol=1e-14)
    assert contact.normal_force == pytest.approx(np.linalg.norm(fc) / np.sqrt(1 + law.mu_e(r * np.linalg.norm(slip)) ** 2))
    for _ in range(8):
        n = rng.normal(size=3)
        x, _, ok, _ = fsolve(equations, np.r_[n / np.linalg.norm(n), np.linalg.norm(fc)], full_output=True, xtol=1e-13)
        if ok == 1 and x[3] > 0:
            assert np.allclose(x[:3], contact.normal, atol=1e-6)


def test_ball_torque_turns_with_the_socket():
    rng = np.random.default_rng(0)
    for law in LAWS[:3]:
        fc, omega = rng.normal(size=(2, 3))
        assert ball(fc, omega, 0.05, law).torque @ omega > 0
        assert adams_ball(fc, omega, 0.05, law) @ omega > 0
        assert np.allclose(ball(fc, fc * 2.0, 0.05, law).torque, 0)


def test_coulomb_ball_in_its_cone_is_the_limit_of_the_regularized_one():
    rng = np.random.default_rng(3)
    omega = rng.normal(size=3)
    fc = 5 * omega + 0.5 * rng.normal(size=3)
    exact, near = ball(fc, omega, 0.05, Law("coulomb", 0.6)), ball(fc, omega, 0.05, Law("regularized", 0.6, 1e-9))
    assert np.allclose(exact.torque, near.torque, atol=1e-7)
    assert exact.torque @ omega == pytest.approx(0, abs=1e-12)
    assert np.allclose(exact.contacts[0].normal, near.contacts[0].normal, atol=1e-6)


def test_sleeve_ends_and_friction_are_those_of_the_notation():
    rng = np.random.default_rng(1)
    (_, f2, f3), (m1, m2, m3) = fc, mc = rng.normal(size=(2, 3))
    a, b, c, law = 0.03, 0.05, 0.3, Law("coulomb", 0.2)
    for sdot in (0.7, -0.7):
        k = 0.2 * np.sign(sdot)
        d3, d2 = (m3 - k * a * f2) / (2 * c), (m2 + k * b * f3) / (2 * c)
        ends = [f2 / 2 - d3, f2 / 2 + d3, f3 / 2 + d2, f3 / 2 - d2]
        out = sleeve(fc, mc, sdot, a, b, c, law)
        assert np.allclose([x.normal_force for x in out.contacts], [*np.abs(ends), abs(m1) / max(a, b)])
        assert out.force == pytest.approx(k * (np.sum(np.abs(ends)) + abs(m1) / max(a, b)))
        assert np.allclose(out.contacts[0].normal, [0, -np.sign(ends[0]), 0])
        assert np.allclose(out.contacts[2].normal, [0, 0, -np.sign(ends[2])])


def test_wedging_force_of_f5():
    c, e, push = 0.2, 0.3, 10.0
    out = journal([0.0, 0, 0], [0, 0, push * e], 0.0, 1.0, 0.0, c, Law("coulomb", 0.1))
    assert np.allclose([k.normal_force for k in out.contacts], push * e / (2 * c))
