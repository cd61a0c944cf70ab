"""The LuGre law: bristles are states of the motion. Below break-away, the law is a spring with hysteresis. In steady sliding, it is
Stribeck's law."""

from __future__ import annotations

from itertools import product

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.engine.checks.contact_functions import ELEMENTS, LAW_NUMBERS, NUMBERS, PAIRS, RATES, States, evaluated, random_states
from tests.engine.friction.test_block_on_belt import BELT, MASS, STIFFNESS, WEIGHT, belt
from trunnion.elements.contact import REGISTRY as CONTACTS
from trunnion.elements.contact import Wrench
from trunnion.elements.contact.contact_element import COMPONENTS
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate

BRISTLES = {"law": "lugre", "bristle_stiffness": 1e4, "bristle_damping": 10.0, "v_stribeck": 0.02, "viscosity": 0.1}
TOL = 1e-8
"""Required agreement over 12 s, with runs at rtol 1e-10 and the independent solver at 1e-11."""


def ratio(v: float, z: float, mu: float = 0.1, most: float = 0.15) -> tuple[float, float]:
    """(k, ż) of LuGre's law for one component: the friction over the normal force, and the rate of the bristle."""
    g = mu + (most - mu) * np.exp(-((v / BRISTLES["v_stribeck"]) ** 2))
    drift = v - BRISTLES["bristle_stiffness"] * abs(v) / g * z
    return BRISTLES["bristle_stiffness"] * z + BRISTLES["bristle_damping"] * drift + BRISTLES["viscosity"] * v, drift


@pytest.mark.default_cases(2)
@pytest.mark.parametrize(("method", "normal_force"), [("auto", "exact"), ("rosenbrock", "exact"), ("auto", "adams")])
def test_a_block_on_a_belt_follows_an_independent_integration(method: str, normal_force: str) -> None:
    def f(t, y):
        k, drift = ratio(y[1] - BELT, y[2])
        return [y[1], -(STIFFNESS * y[0] + WEIGHT * k) / MASS, drift]

    truth = solve_ivp(f, (0.0, 12.0), [0.0, BELT, 0.0], "LSODA", rtol=1e-11, atol=[1e-12, 1e-12, 1e-15], t_eval=[6.0, 9.0, 12.0])
    r = simulate(belt(**BRISTLES, normal_force=normal_force), until=12.0, every=3.0, rtol=1e-10, method=method)
    assert r["rub.q[1]"][2:] + BELT * r.time[2:] == pytest.approx(truth.y[0], abs=TOL)
    assert r["rub.friction.bristle[1]"][2:] == pytest.approx(truth.y[2], abs=TOL / BRISTLES["bristle_stiffness"])
    assert np.abs(r["energy.residual"]).max() <= 1e-8


def test_two_components_share_one_friction() -> None:
    """A wheel on a level shaft slides along the shaft and turns. Adams' normal force is the wheel's weight, so that only two
    equations remain."""
    rub = sm.Friction(mu=0.1, mu_static=0.15, radius=0.05, half_length=0.2, normal_force="adams", **BRISTLES)
    start = sm.Start((0.0, 0.0), (0.3, -8.0))
    joint = sm.Joint("cylindrical", "ground", "wheel", axis="x", friction=rub, start=start)
    wheel = sm.Body(mass=2.0, inertia=(0.01, 0.02, 0.02))
    scene = sm.Scene({"wheel": wheel}, {"shaft": joint}, "shaft", gravity=(0.0, 0.0, -WEIGHT / 2.0))
    r = simulate(scene, until=1.0, every=0.25, rtol=1e-10)

    def f(t, y):
        v = np.array([y[0], 0.05 * y[1]])
        speed = np.hypot(*v)
        g = 0.1 + 0.05 * np.exp(-((speed / 0.02) ** 2))
        drift = v - 1e4 * speed / g * y[2:]
        k = 1e4 * y[2:] + 10.0 * drift + 0.1 * v
        return [-WEIGHT * k[0] / 2.0, -WEIGHT * 0.05 * k[1] / 0.01, *drift]

    truth = solve_ivp(f, (0.0, 1.0), [0.3, -8.0, 0.0, 0.0], "LSODA", rtol=1e-11, atol=1e-14, t_eval=r.time)
    assert r["shaft.qd[1]"] == pytest.approx(truth.y[0], abs=TOL)
    assert r["shaft.qd[2]"] == pytest.approx(truth.y[1], abs=TOL)
    assert r["shaft.friction.bristle[2]"] == pytest.approx(truth.y[3], abs=TOL / 1e4)


def prescribed(amplitude: float) -> Result:
    """A drive moves a block to and fro on its guide, so that friction is a function of displacement alone."""
    drive = sm.Drive(harmonic=sm.Harmonic(amplitude, 1.0, phase=-np.pi / 2, offset=amplitude))
    rub = sm.Friction(mu=0.3, law="lugre", bristle_stiffness=1e3, half_length=1.0, half_width=0.05, half_height=0.05)
    joint = sm.Joint("prismatic", "ground", "block", axis="x", pin="outboard", friction=rub, drive=drive)
    block = sm.Body(mass=1.0, inertia=(1.0, 1.0, 1.0))
    free = sm.Joint("prismatic", "ground", "other", axis="x")  # one body is free to move
    scene = sm.Scene({"block": block, "other": block}, {"guide": joint, "rail": free}, "push", gravity=(0.0, 0.0, -WEIGHT))
    return simulate(scene, until=2.0, every=0.01, rtol=1e-10)


@pytest.mark.parametrize("amplitude", [1e-6, 1e-4, 1e-3])
def test_bristles_below_break_away_are_a_spring_with_hysteresis(amplitude: float) -> None:
    """Between reversals of the motion, z − s g/σ0 falls by the factor exp(−s σ0 Δx/g), at any speed (Dahl)."""
    r, soft = prescribed(amplitude), 0.3 / 1e3
    z, last, expected = 0.0, 0.0, []
    for n, x in enumerate(r["guide.q[1]"]):
        way = 1.0 if (n - 1) % 100 < 50 else -1.0
        z = way * soft + (z - way * soft) * np.exp(-way * (x - last) / soft)
        last = x
        expected.append(z)
    assert r["guide.friction.bristle[1]"] == pytest.approx(expected, abs=1e-9 * soft)
    assert np.abs(r["guide.friction.force"]) == pytest.approx(WEIGHT * 1e3 * np.abs(expected), abs=1e-8)
    if amplitude == 1e-6:  # in so small a motion, the bristle is a spring of stiffness σ0 N
        force, x = r["guide.friction.force"][:51], r["guide.q[1]"][:51]
        assert force == pytest.approx(WEIGHT * 1e3 * x, rel=amplitude / soft, abs=1e-8)


@pytest.mark.parametrize("amplitude", [1e-4, 1e-3])
def test_friction_returns_no_more_energy_than_the_bristles_store(amplitude: float) -> None:
    """At a constant normal force, work + N σ0 z²/2 never rises. The work itself rises while the bristles relax."""
    r = prescribed(amplitude)
    kept = r["guide.friction.work"] + WEIGHT * 1e3 * r["guide.friction.bristle[1]"] ** 2 / 2
    assert np.diff(kept).max() <= 1e-12
    assert np.diff(r["guide.friction.work"]).max() > 1e-7
    assert r["guide.friction.work"][-1] < 0.0
    assert np.abs(r["energy.residual"]).max() <= 1e-10


@pytest.mark.slow
def test_stiff_bristles_are_coulombs_law() -> None:
    """The ball of 8.1. At each stop the bristles reverse while the ball moves on by g/σ0. At the deceleration of the stop, this
    takes a time proportional to 1/√σ0. The difference from Coulomb's law is also proportional to 1/√σ0."""
    exact, errors = pendulum("coulomb"), []
    for stiffness in (1e4, 1e6):
        r = pendulum("lugre", bristle_stiffness=stiffness)
        errors.append(np.abs(r["block.position[1]"] - exact["block.position[1]"]).max())
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.05)
    assert errors[1] < 1e-3


def pendulum(law: str, **numbers) -> Result:
    rub = sm.Friction(mu=0.6, radius=0.05, law=law, **numbers)
    joint = sm.Joint("spherical", "ground", "block", friction=rub, start=sm.Start(sm.AxisAngle("z", np.pi / 2)))
    block = sm.Body(box=(0.1, 1.0, 0.1), mass=78.0, center=(0.0, -0.5, 0.0))
    scene = sm.Scene({"block": block}, {"ball": joint}, "swing", gravity=(0.0, -9.81, 0.0))
    return simulate(scene, until=5.0, every=0.5, rtol=1e-9)


FORMS = list(product(ELEMENTS, (False, True), (1, -1)))


@pytest.mark.default_cases(3)
@pytest.mark.parametrize(("element", "adams", "pin"), FORMS)
def test_steady_sliding_is_coulombs_law(element: str, adams: bool, pin: int) -> None:
    """When the bristles have come to rest at a constant wrench and velocity, friction equals sliding friction."""
    s = random_states(element, "coulomb", 60)
    expected, _, contacts = evaluated(s, adams, pin)
    step, count = stepper(element, adams, pin), RATES[element]
    # the test leaves out a ball that turns nearly about its load: its friction does not settle within this time
    settles = [i for i in range(60) if element != "ball" or adams or slides(s, contacts, i) >= 0.1]
    given = s.wrench[:, settles], s.rates[:, settles], s.numbers[:, settles]
    state = np.zeros((count, len(settles)))
    for _ in range(60):
        drift, friction, slopes = map(np.array, step(*given, state))
        slope = slopes.reshape(count, -1, count).swapaxes(0, 1)  # the array has the shape states × count × count
        h = 1e3 / np.abs(np.linalg.eigvals(slope)).max(axis=1)
        taken = np.linalg.solve(np.eye(count) - h[:, None, None] * slope, (h * drift).T[:, :, None])
        state = state + taken[:, :, 0].T
    worst = np.abs(friction - expected[:, settles]).max(axis=0)
    assert np.all(worst <= 1e-9 * np.abs(given[0]).max(axis=0)), worst


def slides(s: States, contacts: np.ndarray, i: int) -> float:
    """The part of the rotation of ball i that slides. The rest of the rotation is spin about the load."""
    n = contacts[1:4, i] / np.linalg.norm(contacts[1:4, i])
    return float(np.linalg.norm(np.cross(s.rates[:, i], n)) / np.linalg.norm(s.rates[:, i]))


def stepper(element: str, adams: bool, pin: int) -> ca.Function:
    """(rates of the states, friction, derivative of the rates with respect to the states) of (wrench, rates, numbers, states)."""
    e, count = CONTACTS[element], RATES[element]
    s = random_states(element, "coulomb", 1)
    w, r, g, b = ca.SX.sym("w", 6), ca.SX.sym("r", count), ca.SX.sym("g", len(s.numbers)), ca.SX.sym("b", count)
    names = dict(zip((*NUMBERS[element], *LAW_NUMBERS["coulomb"]), ca.vertsplit(g), strict=True)) | {"bristle_stiffness": 1e3}
    each = count // PAIRS[element]
    states = [[b[each * i + k] for k in range(each)] for i in range(PAIRS[element])]
    laws = [LAWS["lugre"](names, [0, ca.sign(r[i]), 0, 0, 0], mine) for i, mine in enumerate(states)]
    on = Wrench({n: w[i] for i, n in enumerate(COMPONENTS)}, pin)
    rates = [r[i] for i in range(count)]
    drift = ca.vertcat(*e.drifts(on, rates, laws, names, adams))
    friction = ca.vertcat(*e.friction(on, rates, laws, names, adams))
    return ca.Function("step", [w, r, g, b], [drift, friction, ca.jacobian(drift, b)])
