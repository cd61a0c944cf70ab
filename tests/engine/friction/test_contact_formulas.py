"""The closed forms of every contact satisfy the contact equations, oppose the motion, and have finite limits."""

from __future__ import annotations

from itertools import product

import casadi as ca
import numpy as np
import pytest

from tests.engine.checks.contact_functions import ELEMENTS, States, evaluated, functions, modes, random_states, reference
from trunnion.elements.contact import REGISTRY as CONTACTS
from trunnion.elements.contact import Wrench
from trunnion.elements.contact.contact_element import COMPONENTS

STATES = 300
"""Random states for each of the 40 combinations: 12,000 in all."""
ROOT = 1e-11
"""The reference finds a ball's root by bracketing, to 1e-15 of a function that is flat near spin along the load; all other contacts
need one solve."""
FORMS = list(product(ELEMENTS, ("regularized", "viscous"), (False, True), (1, -1)))


@pytest.mark.default_cases(2)
@pytest.mark.parametrize(("element", "law", "adams", "pin"), FORMS)
def test_closed_forms_are_the_roots_of_the_contact_equations(element: str, law: str, adams: bool, pin: int) -> None:
    s = random_states(element, law, STATES)
    friction, _, contacts = evaluated(s, adams, pin)
    for i in range(STATES):
        size = np.abs(s.wrench[:, i]).max()
        expected, touching = reference(s, i, adams, pin)
        assert np.abs(friction[:, i] - expected).max() <= ROOT * size, i
        for n, c in enumerate(touching):
            force, vector = contacts[4 * n, i], contacts[4 * n + 1 : 4 * n + 4, i]
            assert abs(force - c.normal_force) <= ROOT * size / (s.number("half_length")[i] if element == "sleeve" else 0.01), (
                i,
                n,
            )
            if not np.isnan(c.normal).any():
                assert np.abs(vector / np.linalg.norm(vector) - c.normal).max() <= 1e-9, (i, n)


@pytest.mark.parametrize("element", CONTACTS)
def test_an_element_has_as_many_springs_as_its_contacts_press_on(element: str) -> None:
    declared, wrench = CONTACTS[element], Wrench(dict.fromkeys(COMPONENTS, ca.SX(1)), 1)
    sizes = {label: ca.SX(1) for s in declared.sizes for label in s.labels}
    assert len(declared.pressed(wrench, [], [], sizes, [])) == declared.springs


@pytest.mark.default_cases(10)
@pytest.mark.parametrize(("element", "law", "adams", "pin"), FORMS)
def test_friction_never_gives_energy(element: str, law: str, adams: bool, pin: int) -> None:
    s = random_states(element, law, 3000, seed=1)
    friction, _, _ = evaluated(s, adams, pin)
    power = -np.sum(friction * s.rates, axis=0)
    round_off = 1e-14 * np.sum(np.abs(friction * s.rates), axis=0)
    assert np.all(power <= round_off)
    assert np.count_nonzero(power < 0) > 2900  # friction takes power in nearly all states
    if element != "ball" and element != "shaft":
        assert np.all(friction * s.rates >= 0)  # in all other elements, each freedom alone dissipates energy


@pytest.mark.default_cases(25)
@pytest.mark.parametrize(("element", "law", "adams", "pin"), FORMS)
def test_no_load_no_friction_and_a_finite_slope(element: str, law: str, adams: bool, pin: int) -> None:
    s = random_states(element, law, 50)
    s = States(element, law, np.zeros_like(s.wrench), s.rates, s.numbers)
    friction, derivative, contacts = evaluated(s, adams, pin)
    assert np.abs(friction).max() <= 1e-140  # the limit is the root of the small number that keeps the slope finite
    assert np.abs(contacts).max() <= 1e-140
    assert np.all(np.isfinite(derivative))


@pytest.mark.parametrize(("element", "law", "adams", "pin"), FORMS)
def test_contacts_that_do_not_slide_have_no_friction(element: str, law: str, adams: bool, pin: int) -> None:
    s = random_states(element, law, 50)
    s = States(element, law, s.wrench, np.zeros_like(s.rates), s.numbers)
    friction, derivative, contacts = evaluated(s, adams, pin)
    assert np.all(friction == 0.0)
    assert np.all(np.isfinite(derivative))
    assert np.all(np.isfinite(contacts))


@pytest.mark.parametrize("law", ["regularized", "viscous"])
@pytest.mark.parametrize("adams", [False, True])
@pytest.mark.parametrize("along", [1.0, -1.0])
def test_a_ball_that_spins_about_its_load_feels_no_torque(law: str, adams: bool, along: float) -> None:
    s = random_states("ball", law, 200)
    rates = along * s.wrench[:3] / np.linalg.norm(s.wrench[:3], axis=0)
    friction, derivative, contacts = evaluated(States("ball", law, s.wrench, rates, s.numbers), adams, 1)
    size = np.linalg.norm(s.wrench[:3], axis=0)
    assert np.all(np.linalg.norm(friction, axis=0) <= 1e-6 * size)  # root of round-off over v_eps; 1e-3 and more for a sliding ball
    assert np.all(np.isfinite(derivative))
    assert np.all(np.isfinite(contacts))
    assert contacts[0] == pytest.approx(size, rel=1e-6)  # one normal carries the whole load


def at_the_kink(s: States, pin: int) -> States:
    """The states with v_eps set to the sliding speed of the first pair. A ball inside its friction cone, |ω × f| < μ |ω · f|, has
    no sliding speed at a kink, so it is left out."""
    speed = np.abs(functions(s.element, s.law, False, pin)[0](s.wrench, s.rates, s.numbers, modes(s, False, pin)).full()[0])
    keep = np.full(speed.shape, True)
    if s.element == "ball":
        f = s.wrench[:3] / np.linalg.norm(s.wrench[:3], axis=0)
        along, across = np.sum(f * s.rates, axis=0), np.linalg.norm(np.cross(f.T, s.rates.T), axis=1)
        square = across**2 - (s.number("mu") * along) ** 2
        keep = square > 1e-6 * across**2
        speed = s.number("radius") * np.sqrt(np.maximum(square, 0.0))
    numbers = np.vstack([s.numbers[:-1], speed])[:, keep]
    return States(s.element, s.law, s.wrench[:, keep], s.rates[:, keep], numbers)


@pytest.mark.parametrize("pin", [1, -1])
@pytest.mark.parametrize("element", ELEMENTS)
def test_the_two_branches_of_the_regularized_law_meet_at_its_kink(element: str, pin: int) -> None:
    s = at_the_kink(random_states(element, "regularized", 300), pin)
    assert s.wrench.shape[1] > 150
    speeds, friction, contacts = functions(element, "regularized", False, pin)
    mode, seen = modes(s, False, pin), []
    now = np.abs(speeds(s.wrench, s.rates, s.numbers, mode).full()[0])
    assert now == pytest.approx(s.number("v_eps"), rel=1e-9)
    for flag in (0.0, 1.0):
        mode[0] = flag
        seen.append([f(s.wrench, s.rates, s.numbers, mode) for f in (friction, contacts)])
    scale = np.abs(s.wrench).max(axis=0) / 0.01  # forces of contacts result from moments over arms of a centimetre
    for slow, fast in ((seen[0][0][0], seen[1][0][0]), (seen[0][1], seen[1][1])):
        assert np.all(np.abs(slow.full() - fast.full()) <= 1e-10 * scale)  # near its cone, the root of a ball loses digits


@pytest.mark.default_cases(31)
@pytest.mark.parametrize(("element", "law", "adams", "pin"), FORMS)
def test_the_slope_of_friction_by_the_load_is_its_derivative(element: str, law: str, adams: bool, pin: int) -> None:
    """Newton's method on the complement equations uses this derivative."""
    s = random_states(element, law, 100)
    mode = modes(s, adams, pin)
    _, f, _ = functions(element, law, adams, pin)
    base, derivative = f(s.wrench, s.rates, s.numbers, mode)
    size = np.abs(s.wrench).max(axis=0)
    n = base.shape[0]
    for k in range(6):
        step = np.zeros_like(s.wrench)
        step[k] = 1e-6 * size
        up, down = (f(s.wrench + d * step, s.rates, s.numbers, mode)[0].full() for d in (1, -1))
        column = derivative.full()[k * n : (k + 1) * n]
        assert np.abs((up - down) / (2e-6 * size) - column).max() <= 1e-4 * max(1.0, np.abs(column).max()), k
