"""Drag and point attraction agree with closed forms. The tests cover both kernels, energy and derivatives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import trunnion
from tests.default_case_selection import sampled
from tests.engine.parts.test_compiled_kernel_equivalence import agree
from tests.engine.parts.test_jacobian import agree as derivatives_agree
from tests.engine.recursion.test_dense_reference import TIME, compared
from tests.reference.scenes.random_scenes import Case, random_loop, random_tree
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import simulate

CLOSE = 1e-9
G = 9.81
SUN = np.array([1.0, 2.0, 3.0])
BODY = sm.Body(mass=2.0, inertia=(0.2, 0.3, 0.4), points={"eye": (0.1, 0.2, -0.1)})


def flying(q: tuple, qd: tuple, **more) -> sm.Scene:
    """A body that moves freely, from a position and a velocity."""
    free = sm.Joint("free", "ground", "b", start=sm.Start(q=(*q, 1.0, 0.0, 0.0, 0.0), qd=(*qd, 0.0, 0.0, 0.0)))
    return sm.Scene({"b": BODY}, {"j": free}, "flight", **more)


def air(**more) -> sm.Drag:
    return sm.Drag("drag", "b", **{"area": 0.3, "coefficient": 0.8, "density": 1.2, **more})


def with_both(make, seed: int) -> Case:
    """A random mechanism with drag at two points. The ground and one of its bodies attract the other bodies."""
    case = make(seed, t=TIME, bodies=4) if make is random_tree else make(seed, t=TIME)
    names = list(case.scene.bodies)
    more = {
        "d1": replace(air(area=2.0), on=f"{names[0]}.s"), "d2": replace(air(coefficient=3.0), on=names[-1]),
        "p1": sm.PointGravity("point_gravity", names[0], "ground", 5.0),
        "p2": sm.PointGravity("point_gravity", names[1], f"{names[-1]}.s", 3.0),
    }  # fmt: skip
    return replace(case, scene=replace(case.scene, forces=case.scene.forces | more))


@pytest.mark.parametrize(("make", "seed"), sampled([(random_tree, 1), (random_loop, 3), (random_tree, 5), (random_loop, 4)], 2))
def test_drag_and_point_gravity_act_as_in_absolute_coordinates(make, seed: int) -> None:
    compared(with_both(make, seed))


def test_both_kernels_and_their_derivatives_agree() -> None:
    hinge = sm.Joint("revolute", "ground", "arm", axis="z")
    more = {"air": replace(air(), on="b.eye"), "sun": sm.PointGravity("point_gravity", "b", "arm.eye", 4.0)}
    scene = flying((1.0, 2.0, 3.0), (4.0, 5.0, 6.0), forces=more)
    scene = replace(scene, bodies=scene.bodies | {"arm": BODY}, joints=scene.joints | {"hinge": hinge})
    agree(scene)
    derivatives_agree(scene)


@pytest.mark.parametrize("kernel", ["parts", "compiled"])
def test_a_fall_through_air_is_its_closed_form(kernel: str) -> None:
    """v = u tanh(g t/u) and s = u²/g ln cosh(g t/u), with u = √(2 m g/(ρ c A)). The work of drag equals the energy that the falling
    body loses."""
    r = simulate(flying((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), forces={"air": air()}), until=9.0, every=0.5, rtol=1e-12, kernel=kernel)
    u = np.sqrt(2 * 2.0 * G / (1.2 * 0.8 * 0.3))
    assert r["j.qd[3]"] == pytest.approx(-u * np.tanh(G * r.time / u), abs=CLOSE * u)
    assert r["j.q[3]"] == pytest.approx(-(u**2) / G * np.log(np.cosh(G * r.time / u)), abs=1e-8)
    assert r["energy.dissipated"] == pytest.approx(-2.0 * G * r["j.q[3]"] - r["j.qd[3]"] ** 2, abs=1e-6)
    assert np.abs(r["energy.residual"]).max() <= 1e-6


@pytest.mark.parametrize("seed", sampled(range(100), 2))
def test_a_shot_through_air_is_what_scipy_integrates(seed: int) -> None:
    rng = np.random.default_rng(seed)
    drag, v0 = air(area=float(rng.uniform(0.1, 2.0))), rng.normal(size=3) * 30.0
    r = simulate(flying((0.0, 0.0, 0.0), tuple(v0), forces={"air": drag}), until=2.0, every=0.5, rtol=1e-12)
    k = drag.density * drag.coefficient * drag.area / 2 / 2.0

    def slope(_: float, y: np.ndarray) -> np.ndarray:
        return np.concatenate([y[3:], -k * np.linalg.norm(y[3:]) * y[3:] - [0.0, 0.0, G]])

    expected = solve_ivp(slope, (0.0, 2.0), [0.0, 0.0, 0.0, *v0], "DOP853", r.time, rtol=1e-13, atol=1e-13).y
    for i in range(3):
        assert r[f"j.q[{i + 1}]"] == pytest.approx(expected[i], abs=CLOSE * 60.0)


def kepler(gm: float, r0: np.ndarray, v0: np.ndarray, t: float) -> np.ndarray:
    """Position on the ellipse after a time, from Kepler's equation M = E − e sin E."""
    r, h = np.linalg.norm(r0), np.cross(r0, v0)
    to_nearest = np.cross(v0, h) / gm - r0 / r
    e, a = np.linalg.norm(to_nearest), 1.0 / (2.0 / r - v0 @ v0 / gm)
    x = to_nearest / e
    y = np.cross(h / np.linalg.norm(h), x)
    first = np.arctan2(r0 @ y / (a * np.sqrt(1 - e * e)), r0 @ x / a + e)
    mean = first - e * np.sin(first) + np.sqrt(gm / a**3) * t
    angle = brentq(lambda u: u - e * np.sin(u) - mean, mean - 1.0, mean + 1.0, xtol=1e-14)
    place = a * (np.cos(angle) - e) * x + a * np.sqrt(1 - e * e) * np.sin(angle) * y
    return np.asarray(place)


@pytest.mark.parametrize("seed", sampled(range(100), 3))
def test_a_body_around_a_point_follows_keplers_ellipse(seed: int) -> None:
    rng = np.random.default_rng(seed)
    gm, r0 = float(rng.uniform(1.0, 50.0)), rng.normal(size=3)
    v0 = np.cross(r0, rng.normal(size=3))
    v0 *= rng.uniform(0.7, 1.2) * np.sqrt(gm / np.linalg.norm(r0)) / np.linalg.norm(v0)
    sun = sm.PointGravity("point_gravity", "b", "ground.sun", gm)
    scene = flying(tuple(r0 + SUN), tuple(v0), gravity=(0.0, 0.0, 0.0), forces={"sun": sun},
                   ground=sm.Ground(points={"sun": tuple(SUN)}))  # fmt: skip
    around = 2 * np.pi * np.sqrt(np.linalg.norm(r0) ** 3 / gm)
    r = simulate(scene, until=around, every=around / 4, rtol=1e-13)
    expected = np.array([kepler(gm, r0, v0, t) for t in r.time]) + SUN
    found = np.column_stack([r[f"j.q[{i}]"] for i in (1, 2, 3)])
    assert np.abs(found - expected).max() <= 1e-8 * np.linalg.norm(r0)
    assert r["sun.force"] == pytest.approx(gm * 2.0 / r["sun.length"] ** 2, rel=1e-14)
    energy = r["energy.kinetic"] + r["energy.potential"]
    assert np.ptp(energy) <= CLOSE * r["energy.kinetic"].max()


def test_the_derivatives_by_their_numbers_are_those_of_the_closed_forms() -> None:
    """Derivatives of a vertical fall through air with respect to the area. Derivatives of the first 0.1 s of a fall towards a point
    with respect to gm and mass."""
    scene = flying((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), forces={"air": air()})
    found = trunnion.sensitivity(scene, ["forces.air.area"], ["j.qd[3]"], 3.0, 1.0, rtol=1e-11)

    def speed(area: float, t: np.ndarray) -> np.ndarray:
        u = np.sqrt(2 * 2.0 * G / (1.2 * 0.8 * area))
        return np.asarray(-u * np.tanh(G * t / u))

    expected = (speed(0.3 + 1e-5, found.time) - speed(0.3 - 1e-5, found.time)) / 2e-5
    assert found.derivatives[:, 0, 0] == pytest.approx(expected, abs=1e-7)
    sun = sm.PointGravity("point_gravity", "b", "ground", 7.0)
    scene = flying((2.0, 0.0, 0.0), (0.0, 1.0, 0.0), gravity=(0.0, 0.0, 0.0), forces={"sun": sun})
    found = trunnion.sensitivity(scene, ["forces.sun.gm", "bodies.b.mass"], ["j.q[1]"], 1.0, 1.0, rtol=1e-11)
    by_gm = [kepler(gm, np.array([2.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), 1.0)[0] for gm in (7.0 - 1e-4, 7.0 + 1e-4)]
    assert found.derivatives[-1, 0] == pytest.approx([(by_gm[1] - by_gm[0]) / 2e-4, 0.0], abs=1e-6)
