"""Runs with joints of every type: energy and momentum are conserved, exact motions are reproduced, and friction only takes
energy."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from tests.engine.checks.random_scene_properties import DEVICES, some_joint
from tests.paper_friction_law import PAPER
from tests.reference.scenes.random_scenes import ALL_TYPES, covering, random_loop, random_tree
from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate

RTOL = 1e-10
KEPT = 1e-7
"""Allowed error relative to the energy converted: the accumulated errors of hundreds of steps at RTOL. A missing velocity term
loses percents."""


def turned_over(r: Result) -> float:
    """Converted energy: the rise and fall of kinetic energy plus the dissipated energy, J."""
    return float(np.abs(np.diff(r["energy.kinetic"])).sum() + np.abs(np.diff(r["energy.dissipated"])).sum())


def run(scene: sm.Scene, until: float, **how) -> Result:
    r = simulate(scene, until=until, every=until / 200, rtol=RTOL, **how)
    assert r.outcome.ok, r.outcome
    return r


@pytest.mark.default_cases(9)
@pytest.mark.parametrize("kind", [k for k in ALL_TYPES if REGISTRY[k].nv])
def test_two_bodies_on_a_joint_keep_their_energy(kind: str) -> None:
    """Inertias, frames and rates are random. There is no friction and no device. Either body may be the inboard body of the
    joint."""
    case = random_tree(5, 2, types=(kind,), friction=0.0, devices=0.0, drives=0.0, loads=False)
    r = run(case.scene, 2.0)
    energy = r["energy.kinetic"] + r["energy.potential"]
    assert turned_over(r) > 5.0
    assert np.abs(energy - energy[0]).max() <= KEPT * turned_over(r)
    assert np.abs(r["energy.residual"] - (energy - energy[0])).max() <= 1e-10 * turned_over(r)


PARTS = {d: some_joint(lambda j, d=d: getattr(j, d) is not None) for d in (*DEVICES, "friction")}
ENERGIES = covering(PARTS | {"a load": lambda case: bool(case.scene.forces)}, random_tree, least=3)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", ENERGIES)
def test_random_trees_account_for_their_energy(seed: int) -> None:
    """The mechanisms have friction, springs, dampers, stops, drives and loads. The energy of the bodies agrees with the work
    done."""
    case = ENERGIES[seed]
    r = run(case.scene, 0.5)
    assert np.abs(r["energy.residual"]).max() <= KEPT * turned_over(r)
    assert np.all(np.diff(r["energy.dissipated"]) >= -1e-9 * turned_over(r))
    for name in (n for n, j in case.scene.joints.items() if j.friction):
        assert np.all(np.diff(r[f"{name}.friction.work"]) <= 1e-12 * turned_over(r))


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", range(3))
def test_random_loops_account_for_their_energy(seed: int) -> None:
    r = run(random_loop(seed, friction=0.8).scene, 0.5)
    assert np.abs(r["energy.residual"]).max() <= KEPT * turned_over(r)
    assert r["audit.constraint"].max() <= 1e-12


def test_a_free_body_keeps_its_momentum() -> None:
    """A body with three unequal moments of inertia spins near its unstable axis, without gravity."""
    inertia = np.array([0.2, 0.3, 0.45])
    body = sm.Body(mass=2.0, inertia=tuple(inertia), center=(0.1, -0.2, 0.05))
    start = sm.Start((0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.02, 9.0, 0.03))
    r = run(sm.Scene({"b": body}, {"j": sm.Joint("free", "ground", "b", start=start)}, gravity=(0.0, 0.0, 0.0)), 5.0)
    w, x, y, z = (r[f"b.orientation[{i}]"] for i in (1, 2, 3, 4))
    R = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    omega = np.array([r[f"b.angular_velocity[{k}]"] for k in (1, 2, 3)])
    L = np.einsum("ijt,j,kjt,kt->it", R, inertia, R, omega)
    assert np.ptp(np.einsum("it,it->t", R[:, 1], omega)) > 10.0  # the body tumbles over
    assert np.abs(L - L[:, :1]).max() <= 1e-7
    v = np.array([r[f"b.velocity[{k}]"] for k in (1, 2, 3)])
    assert np.abs(v - v[:, :1]).max() <= 1e-8
    assert np.abs(w * w + x * x + y * y + z * z - 1.0).max() <= 1e-15


def test_a_screw_falls_as_its_pitch_allows() -> None:
    """(I + m p²) q̈ = −m g p with p the travel per radian."""
    p, m, spin = 0.3 / (2 * np.pi), 2.0, 0.02
    body = sm.Body(mass=m, inertia=(0.1, 0.1, spin))
    r = run(sm.Scene({"b": body}, {"j": sm.Joint("screw", "ground", "b", axis="z", pitch=0.3, start=sm.Start(0.5, 2.0))}), 2.0)
    a = -m * 9.81 * p / (spin + m * p * p)
    assert r["j.q[1]"] == pytest.approx(0.5 + 2.0 * r.time + a * r.time**2 / 2, abs=1e-9)
    assert r["b.position[3]"] == pytest.approx(p * r["j.q[1]"], abs=1e-13)
    assert r["j.reaction.force[1]"] == pytest.approx(-m * (9.81 + p * a), abs=1e-9)  # e1 points up; the force acts on the ground


def test_a_body_on_a_plane_glides_and_spins() -> None:
    """Gravity across the plane does not affect the motion along the plane. Gravity along the plane gives a parabola."""
    body = sm.Body(box=(0.4, 0.2, 0.1), mass=3.0)
    joint = sm.Joint("planar", "ground", "b", axis="z", start=sm.Start((0.1, 0.2, 0.3), (1.0, -2.0, 4.0)))
    r = run(sm.Scene({"b": body}, {"j": joint}, gravity=(0.0, 3.0, -9.81)), 1.0)
    assert r["b.position[1]"] == pytest.approx(0.1 + r.time, abs=1e-10)
    assert r["b.position[2]"] == pytest.approx(0.2 - 2.0 * r.time + 1.5 * r.time**2, abs=1e-10)
    assert r["j.q[3]"] == pytest.approx(0.3 + 4.0 * r.time, abs=1e-10)
    assert r["j.reaction.force[1]"] == pytest.approx(-3.0 * 9.81, abs=1e-11)


@cache
def top() -> Result:
    """A heavy symmetric top on a ball, spinning about its axis."""
    body = sm.Body(mass=1.0, inertia=(0.05, 0.05, 0.02), center=(0.0, 0.0, 0.4))
    tilt = 0.4
    start = sm.Start((np.cos(tilt / 2), np.sin(tilt / 2), 0.0, 0.0), tuple(40.0 * np.array([0.0, -np.sin(tilt), np.cos(tilt)])))
    return run(sm.Scene({"top": body}, {"ball": sm.Joint("spherical", "ground", "top", start=start)}), 3.0)


def test_a_top_keeps_spin_and_vertical_momentum() -> None:
    r = top()
    axis = np.array([r[f"top.position[{k}]"] for k in (1, 2, 3)]) / 0.4
    omega = np.array([r[f"top.angular_velocity[{k}]"] for k in (1, 2, 3)])
    spin = np.sum(axis * omega, axis=0)
    assert np.abs(spin - spin[0]).max() <= 1e-7
    across = omega - spin * axis
    vertical = (0.05 + 0.16) * across[2] + 0.02 * spin * axis[2]
    assert np.abs(vertical - vertical[0]).max() <= 1e-8
    assert np.ptp(np.unwrap(np.arctan2(axis[1], axis[0]))) > 3.0  # the axis has turned all the way round


def test_angles_of_cut_joints_continue_past_a_turn() -> None:
    """The four-bar's couplers turn with their cranks, over the top repeatedly. Columns of angles never jump by 2π."""
    r = simulate("crank_slider", until=2.0, every=0.005, overrides=PAPER)
    assert r["crank_pivot.q[1]"][-1] == pytest.approx(20.0, abs=1e-12)
    r = simulate("n_four_bar", until=4.0, every=0.005)
    for n in r.matching("*.q[1]"):
        assert np.abs(np.diff(r[n])).max() < 1.0, n
