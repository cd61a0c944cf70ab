"""Bushings hold, oscillate and conserve energy according to their closed forms. Both kernels and a dense solve in absolute
coordinates agree."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline
from scipy.special import ellipj, ellipk

import trunnion
from tests.engine.parts.test_compiled_kernel_equivalence import agree
from tests.engine.parts.test_jacobian import agree as derivatives_agree
from tests.engine.recursion.test_dense_reference import TIME, compared
from tests.reference.scenes.random_scenes import Case, random_loop, random_tree
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import simulate

SIX = {"stiffness": (900.0, 1300.0, 2100.0), "turning_stiffness": (11.0, 17.0, 29.0)}
DAMPED = {"damping": (3.0, 4.0, 5.0), "turning_damping": (0.2, 0.3, 0.4)}
CLOSE = 1e-9
MASS, G = 2.0, 9.81


def bush(a: str, b: str, **more) -> sm.Bushing:
    return sm.Bushing("bushing", (a, b), **{**SIX, **more})


def held(**more) -> sm.Scene:
    """A body in space, held by one bushing at its eye."""
    body = sm.Body(mass=MASS, inertia=(0.2, 0.3, 0.4), points={"eye": (0.1, 0.05, -0.02)})
    joint = sm.Joint("free", "ground", "b", start=sm.Start(q=(-0.1, -0.05, 0.02, 1.0, 0.0, 0.0, 0.0), **more.pop("start", {})))
    return sm.Scene({"b": body}, {"j": joint}, "held", gravity=more.pop("gravity", (0.0, 0.0, -G)),
                    forces={"bush": bush("ground", "b.eye", **more)})  # fmt: skip


@cache
def with_bushings(make, seed: int) -> Case:
    """A random mechanism with bushings of scalar stiffness, from the ground and between its bodies."""
    case = make(seed, t=TIME, bodies=4) if make is random_tree else make(seed, t=TIME)
    names = list(case.scene.bodies)
    forces = {
        "x1": bush("ground.a", f"{names[0]}.s", axis=(1.0, 2.0, -0.5), reference=(0.0, 0.3, 1.0), **DAMPED),
        "x2": bush(f"{names[1]}.a", f"{names[-1]}.s", axis="z", damping=2.0),
        "x3": bush(f"{names[0]}.b", "ground", stiffness=50.0, turning_stiffness=7.0, turning_damping=0.5),
    }
    return replace(case, scene=replace(case.scene, forces=case.scene.forces | forces))


@pytest.mark.parametrize(("make", "seed"), [(random_tree, 1), (random_tree, 5), (random_loop, 3)])
def test_a_bushing_acts_as_in_absolute_coordinates(make, seed: int) -> None:
    compared(with_bushings(make, seed))


def test_both_kernels_and_their_derivatives_agree() -> None:
    scene = with_bushings(random_tree, 1).scene
    agree(scene)
    derivatives_agree(scene)


def test_a_bushing_yields_by_load_over_stiffness() -> None:
    """A force through the point of the bushing and a torque about one axis act on the bushing at rest. The bushing yields by m g/k
    along each axis, and by asin(T/k) about the axis of the torque."""
    push, twist = (30.0, -40.0, 0.0), 5.0
    scene = held()
    weight = sm.Force("force", "b.eye", (0.0, 0.0, MASS * G))
    scene = replace(scene, gravity=(0.0, 0.0, 0.0), forces=scene.forces | {
        "down": replace(weight, force=(0.0, 0.0, -MASS * G)), "push": sm.Force("force", "b.eye", push),
        "twist": sm.Torque("torque", "b", (0.0, 0.0, twist))})  # fmt: skip
    found = trunnion.equilibrium(scene)
    angle = np.arcsin(twist / SIX["turning_stiffness"][2])
    at = np.array([*push[:2], -MASS * G]) / SIX["stiffness"]
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    q = np.array(found.q["j"])
    assert q[:3] == pytest.approx(at - turn @ [0.1, 0.05, -0.02], abs=CLOSE)
    assert 2 * np.arctan2(q[6], q[3]) == pytest.approx(angle, abs=CLOSE)


def test_a_bushing_about_one_axis_swings_as_a_pendulum() -> None:
    """J q̈ = −κ sin q: q = 2 asin(k cd(t √(κ/J))), k = sin(q0/2), over three swings of 150° each way."""
    stiffness, inertia, start = SIX["turning_stiffness"][2], 0.4, np.radians(150)
    hinge = sm.Joint("revolute", "ground", "b", axis="z", start=sm.Start(q=float(start)))
    body = sm.Body(mass=MASS, inertia=(0.2, 0.3, inertia))
    scene = sm.Scene({"b": body}, {"hinge": hinge}, "swing", gravity=(0.0, 0.0, 0.0), forces={"bush": bush("ground", "b")})
    rate, k = np.sqrt(stiffness / inertia), np.sin(start / 2)
    r = simulate(scene, until=12 * ellipk(k * k) / rate, every=0.01, rtol=1e-12)
    _, cn, dn, _ = ellipj(rate * r.time, k * k)
    assert r["hinge.q[1]"] == pytest.approx(2 * np.arcsin(k * cn / dn), abs=CLOSE)
    assert r["bush.turn[3]"] == pytest.approx(r["hinge.q[1]"], abs=CLOSE)
    assert r["bush.torque[3]"] == pytest.approx(-stiffness * np.sin(r["hinge.q[1]"]), abs=CLOSE)


def test_small_swings_have_the_six_frequencies_of_its_stiffnesses() -> None:
    scene = replace(held(gravity=(0.0, 0.0, 0.0)), forces={"bush": bush("ground", "b")})
    scene = replace(scene, joints={"j": sm.Joint("free", "ground", "b")})
    expected = np.sqrt(np.array([*SIX["stiffness"], *SIX["turning_stiffness"]]) / [MASS, MASS, MASS, 0.2, 0.3, 0.4])
    assert [m.frequency for m in trunnion.modes(scene).modes] == pytest.approx(sorted(expected / (2 * np.pi)), rel=CLOSE)


def test_a_bushing_keeps_energy_without_damping_and_accounts_for_it_with_damping() -> None:
    """The body tumbles through whole turns about all axes, where every sequence of angles would be singular."""
    start = {"start": {"qd": (0.5, -0.7, 0.3, 18.0, -16.0, 14.0)}}
    r = simulate(held(**start), until=3.0, every=0.01, rtol=1e-11)
    assert np.abs([r[f"bush.turn[{k}]"] for k in (1, 2, 3)]).max() > 2.5
    energy = r["energy.kinetic"] + r["energy.potential"]
    assert np.abs(energy - energy[0]).max() <= CLOSE * r["energy.kinetic"].max()
    assert r["energy.dissipated"] == pytest.approx(np.zeros(len(r)), abs=0.0)
    r = simulate(held(**start, **DAMPED), until=3.0, every=0.002, rtol=1e-11)
    assert np.abs(r["energy.residual"]).max() <= CLOSE * r["energy.kinetic"].max()
    assert np.all(np.diff(r["energy.dissipated"]) > 0.0)
    stored = r["energy.potential"] - MASS * G * r["b.position[3]"]
    lost = r["energy.dissipated"] - r["energy.dissipated"][0]
    given = make_interp_spline(r.time, r["bush.power"], k=5).integrate(0.0, r.time[-1])
    # splines of degree 5 through rows 2 ms apart are precise to this limit
    assert given == pytest.approx(-(stored[-1] - stored[0]) - lost[-1], rel=1e-6)


def test_a_bushing_between_placed_bodies_is_relaxed_in_their_placement() -> None:
    """A tilted arm on the ground. The axes of the bushing are the axes of the world. The bushing exerts no force until the arm
    moves."""
    tilt = sm.Turn(axis="y", angle=0.4)
    arm = sm.Body(mass=MASS, inertia=(0.2, 0.3, 0.4), points={"eye": (0.3, 0.0, 0.0)}, position=(0.2, 0.1, 0.5), orientation=tilt)
    pull = sm.Force("force", "arm.eye", (0.0, 0.0, 12.0))
    scene = sm.Scene({"arm": arm}, {"j": sm.Joint("free", "ground", "arm")}, "placed", gravity=(0.0, 0.0, 0.0),
                     forces={"bush": bush("ground", "arm.eye", **DAMPED)})  # fmt: skip
    still = simulate(scene, until=0.1, every=0.1)
    for name in ("offset", "turn", "force", "torque"):
        assert np.abs([still[f"bush.{name}[{k}]"] for k in (1, 2, 3)]).max() <= 1e-14
    r = simulate(replace(scene, forces=scene.forces | {"pull": pull}), until=40.0, every=40.0, rtol=1e-10)
    assert r["bush.offset[3]"][-1] == pytest.approx(12.0 / SIX["stiffness"][2], abs=CLOSE)


def test_a_bushings_motion_has_derivatives() -> None:
    """x = (m g/k)(1 − cos t √(k/m)) on a rail. The derivative is with respect to k."""
    k, rail = SIX["stiffness"][2], sm.Joint("prismatic", "ground", "b", axis="z")
    scene = sm.Scene({"b": sm.Body(mass=MASS, inertia=(1.0, 1.0, 1.0))}, {"rail": rail}, "down",
                     forces={"bush": bush("ground", "b")})  # fmt: skip
    s = trunnion.sensitivity(scene, ["forces.bush.stiffness[3]"], ["rail.q[1]"], 1.0, 0.1)
    w, t = np.sqrt(k / MASS), s.time
    exact = MASS * G / k**2 * (1 - np.cos(w * t)) - MASS * G / k * np.sin(w * t) * t / (2 * np.sqrt(k * MASS))
    assert s.derivatives[:, 0, 0] == pytest.approx(exact, abs=1e-6 * np.abs(exact).max())  # both runs have the scene's rtol


def test_both_ends_on_one_part_are_refused() -> None:
    with pytest.raises(trunnion.SceneError, match="connect two different bodies with the bushing"):
        simulate(replace(held(), forces={"bush": bush("b", "b.eye")}))
