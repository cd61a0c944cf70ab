"""Loops at the end of their reach, and orientations that become singular. The tests check where a run ends for this reason, with
which outcome, and where the run continues."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.reference.mechanics.rotation import rotation_about
from tests.stability.equivalent_scenes import TELLINGS, TIME, told
from trunnion.elements.joints import REGISTRY
from trunnion.scene import load_scene
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import simulate
from trunnion.simulation.runtime_interface import simulation_block as bl

METHODS = tuple(bl.METHODS)
REACH = np.arcsin(0.6) / 10
"""Time at which example 8.2 with a rod of 0.3 m is stretched to its end, s."""


def short_rod(rubs: bool = False) -> sm.Scene:
    """Example 8.2 with a rod of 0.3 m, which prevents a full turn of the crank of 0.5 m."""
    scene = load_scene("crank_slider")
    bodies = scene.bodies | {"rod": replace(scene.bodies["rod"], center=(0.15, 0.0, 0.0), points={"end": (0.3, 0.0, 0.0)})}
    joints = {
        n: replace(j, friction=j.friction if rubs else None, start=sm.Start(q=0.8) if n == "guide" else None)
        for n, j in scene.joints.items()
    }
    return replace(scene, bodies=bodies, joints=joints, simulation=replace(scene.simulation, until=0.2))


def rings(other: float, short: float = 0.0) -> sm.Scene:
    """A platform in three rings (outer ring about x, cross about z and y) with prescribed motion. A pan to 90° (less ``short``)
    within a second brings the rings' axes into one plane. The following tilt is about the lost axis."""
    box = sm.Body(box=(0.2, 0.15, 0.1), density=1000.0)
    pan = sm.Drive(ramp=sm.Ramp(np.pi - 2 * short, 0.0, duration=1.0))
    tilt = sm.Drive(ramp=sm.Ramp(0.0, other, duration=0.5, begin=1.0))
    joints = {
        "outer": sm.Joint("revolute", "ground", "ring", axis="x"),
        "cross": sm.Joint("universal", "ring", "platform", axis="z", reference="y"),
        "tilt": sm.Joint("revolute", "ground", "yoke", axis="y", drive=tilt),
        "pan": sm.Joint("revolute", "yoke", "platform", axis="z", drive=pan),
    }
    return sm.Scene({"ring": box, "yoke": box, "platform": box}, joints, gravity=(0, 0, 0), simulation=sm.Simulation(until=2.0))


def spherical_four_bar() -> sm.Scene:
    """Four revolutes whose axes meet at a point: 40° across the crank, 35° across the coupler, 50° across the rocker, 70° across
    the ground. Coupler and rocker are stretched when the crank's pin is 85° from the rocker's."""

    def at(tilt: float) -> tuple[float, float, float]:
        return (float(np.cos(np.radians(tilt))), float(np.sin(np.radians(tilt))), 0.0)

    box = sm.Body(box=(0.2, 0.15, 0.1), density=1000.0)
    joints = {
        "crank": sm.Joint("revolute", "ground", "a", axis=at(0), drive=sm.Drive(constant=sm.Constant(1.0))),
        "first": sm.Joint("revolute", "a", "b", axis=at(40), start=sm.Start(q=1.0)),
        "second": sm.Joint("revolute", "b", "c", axis=at(75)),
        "rocker": sm.Joint("revolute", sm.Side("ground", axis=at(70)), sm.Side("c", axis=at(25))),
    }
    return sm.Scene(dict.fromkeys("abc", box), joints, gravity=(0, 0, 0), simulation=sm.Simulation(until=5.0))


@pytest.mark.default_cases(4)
@pytest.mark.parametrize("telling", TELLINGS)
@pytest.mark.parametrize("method", METHODS)
def test_a_loop_at_the_end_of_its_reach_is_named(method: str, telling: str) -> None:
    scene = told(short_rod(), telling, seed=3)
    unit = TIME if telling == TELLINGS[2] else 1.0
    r = simulate(scene, every=1e-3 * unit, method=method)
    assert (r.outcome.name, r.outcome.ok, r.outcome.joint) == ("open_loop", False, "crank_pin")
    assert r.outcome.time == pytest.approx(REACH * unit, abs=1e-5 * unit)
    assert 0.0 <= r.outcome.numbers["independence"] < 1e-4
    assert "the loop is crank_pivot, guide, slider_pin, crank_pin; driven: crank_pivot" in r.outcome.advice
    assert 0.0 <= r.outcome.time - r.time[-1] <= 1e-3 * unit
    assert np.isfinite(r.data).all()


def test_a_fixed_step_across_the_end_of_reach_ends_as_an_open_loop() -> None:
    r = simulate(short_rod(), step=1e-4, method="rk5")
    assert (r.outcome.name, r.outcome.joint) == ("open_loop", "crank_pin")
    assert REACH - 2e-4 <= r.outcome.time <= REACH


def test_a_pin_that_locks_before_the_end_of_reach_has_jammed() -> None:
    """At the distance μ r/√(1+μ²) of the rod from the end of reach, the line of force touches the pin's friction circle. At this
    distance, a toggle jams for any later motion."""
    r = simulate(short_rod(rubs=True))
    assert (r.outcome.name, r.outcome.joint) == ("jammed", "slider_pin")
    assert REACH - 1e-4 < r.outcome.time < REACH - 1e-6


def test_a_loop_that_only_touches_the_end_of_its_reach_continues() -> None:
    """The rod is a micrometre longer than the crank. The rod is nearly upright twice a turn, and the motion continues."""
    scene = short_rod()
    length = 0.5 + 1e-6
    bodies = scene.bodies | {"rod": replace(scene.bodies["rod"], points={"end": (length, 0.0, 0.0)})}
    joints = scene.joints | {"guide": replace(scene.joints["guide"], start=sm.Start(q=1.0))}
    assert simulate(replace(scene, bodies=bodies, joints=joints), until=1.0).outcome.ok


@pytest.mark.default_cases(4)
@pytest.mark.parametrize("telling", TELLINGS)
@pytest.mark.parametrize("method", METHODS)
def test_rings_whose_axes_lie_in_one_plane_cannot_turn_across_it(method: str, telling: str) -> None:
    unit = TIME if telling == TELLINGS[2] else 1.0
    r = simulate(told(rings(1.0), telling, seed=5), every=0.01 * unit, method=method, rtol=1e-4)
    assert (r.outcome.name, r.outcome.ok, r.outcome.joint) == ("gimbal_lock", False, "cross")
    assert r.outcome.time == pytest.approx(1.0 * unit, abs=1e-3 * unit)
    assert 0.0 <= r.outcome.numbers["independence"] < 1e-4
    assert "the loop is outer, tilt, pan, cross; driven: tilt, pan" in r.outcome.advice
    assert np.isfinite(r.data).all()


@pytest.mark.parametrize(("other", "short"), [(0.0, 0.0), (1.0, 0.2), (1.0, 1e-3)])
def test_rings_may_come_into_one_plane_and_pass_it_by(other: float, short: float) -> None:
    """A run continues through the plane if there is no motion across it. A run also passes the plane at a distance of 0.001 rad, at
    any speed of the rings."""
    r = simulate(rings(other, short))
    assert r.outcome.ok
    assert r["audit.constraint"].max() <= 1e-9


def test_a_spherical_linkage_at_the_end_of_its_reach_is_a_gimbal() -> None:
    """At the end of reach, the axes of coupler and rocker, which turn freely, are in one plane."""
    r = simulate(spherical_four_bar(), every=0.01)
    assert (r.outcome.name, r.outcome.ok) == ("gimbal_lock", False)
    ground, crank, stretched = np.radians([70.0, 40.0, 85.0])
    turn = np.arccos((np.cos(stretched) - np.cos(ground) * np.cos(crank)) / (np.sin(ground) * np.sin(crank)))
    assert r.outcome.time == pytest.approx(turn, abs=1e-5)


# -- No joint becomes singular by itself (theory, "End of reach") -----------------------------------------------------------------


def frames(kind: str, q: np.ndarray) -> np.ndarray:
    """The rotation R(q) of a joint type."""
    return np.array(REGISTRY[kind].rotation([float(x) for x in q], np), float)


@pytest.mark.parametrize("kind", REGISTRY)
def test_the_freedoms_of_a_joint_are_independent_whatever_its_coordinates(kind: str) -> None:
    """Π has full rank for all coordinates. The least singular value of its columns equals the value for orthogonal unit axes."""
    rng, joint = np.random.default_rng(7), REGISTRY[kind]
    for _ in range(200 if joint.nv else 0):
        q = rng.normal(size=joint.nq) * np.pi
        R = frames(kind, q)
        columns = np.zeros((6, joint.nv))
        for n, axes in enumerate(joint.axes):
            for a in axes:
                axis = (np.eye(3) if a.side == "in" else R)[:, a.index]
                columns[3 * a.rot : 3 * a.rot + 3, n] += axis
        assert np.linalg.svd(columns, compute_uv=False)[-1] >= 1.0 - 1e-12


@pytest.mark.parametrize("kind", [k for k, j in REGISTRY.items() if j.cuttable and j.rows_r])
def test_the_rows_of_a_closed_cut_joint_are_independent_whatever_its_coordinates(kind: str) -> None:
    """G of (47) with respect to one part's rotation is h_in × h_out. Both vectors are unit vectors, and are perpendicular where the
    joint is closed."""
    rng, joint = np.random.default_rng(7), REGISTRY[kind]
    for _ in range(200):
        R = frames(kind, rng.normal(size=joint.nq) * np.pi)
        rows = np.array([np.cross(np.eye(3)[m], R[:, k]) for m, k in joint.rows_r])
        assert np.linalg.svd(rows, compute_uv=False)[-1] >= 1.0 - 1e-12


@pytest.mark.parametrize("angle", [0.0, np.pi / 2, np.pi, 2.0])
def test_angles_of_a_cut_universal_joint_are_found_at_any_bend(angle: float) -> None:
    """At a right angle a Cardan joint transmits no torque, but its angles are as precise as at any other angle."""
    for first in (0.3, np.pi / 2, -3.0):
        R = rotation_about(0, first) @ rotation_about(1, angle)
        ops = type("ops", (), {"atan2": staticmethod(np.arctan2)})
        got = REGISTRY["universal"].measure(R.tolist(), [0.0] * 3, ops)
        assert np.exp(1j * np.array(got)) == pytest.approx(np.exp(1j * np.array([first, angle])), abs=1e-14)


def driven_piston(phase: float, amplitude: float) -> dict[str, Any]:
    """A prescribed motion of the piston moves crank and rod, x = 0.15 m + amplitude·sin(2π t + phase). The dead centres are at 0.1
    and 0.2 m."""
    x = 0.15 + amplitude * math.sin(phase)
    angle = math.acos(max(-1.0, min(1.0, (x * x + 0.05**2 - 0.15**2) / (2 * x * 0.05))))
    link = {"mass": 1, "inertia": [1e-3, 1e-3, 2e-3]}
    drive = {"harmonic": {"amplitude": amplitude, "frequency": 1, "phase": phase, "offset": 0.15}}
    joints = {
        "main": {"type": "revolute", "inboard": "ground", "outboard": "crank", "start": {"q": angle}},
        "big": {"type": "revolute", "inboard": "crank.pin", "outboard": "rod"},
        "small": {"type": "revolute", "inboard": "rod.end", "outboard": "piston"},
        "guide": {"type": "prismatic", "inboard": "ground", "outboard": "piston", "drive": drive},
    }
    bodies = {"crank": link | {"points": {"pin": [0.05, 0, 0]}}, "rod": link | {"points": {"end": [0.15, 0, 0]}}, "piston": link}
    joints = {n: {"axis": "x" if n == "guide" else "z"} | j for n, j in joints.items()}
    return {"gravity": [0, 0, 0], "bodies": bodies, "joints": joints, "simulation": {"until": 0.9}}


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("method", ["auto", "rk5", "rk8", "rosenbrock"])
@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8])
def test_a_driven_loop_that_passes_its_dead_centre_ends_by_this_name(method: str, rtol: float) -> None:
    r = simulate(driven_piston(math.pi / 6, 0.05), method=method, rtol=rtol)
    assert r.outcome.ok
    assert r.certificate.dead_centre == pytest.approx(1 / 6, abs=2e-4)
    assert any(n.startswith("dead centre at t = 0.16") for n in r.notes)
    short = simulate(driven_piston(math.pi / 6, 0.049), method=method, rtol=rtol)
    assert short.outcome.ok
    assert short.certificate.dead_centre is None


@pytest.mark.parametrize("method", ["auto", "rk5", "rk8", "rosenbrock"])
def test_a_drive_that_begins_on_the_dead_centre_ends_as_dead_centre(method: str) -> None:
    assert simulate(driven_piston(math.pi / 2, 0.05), method=method).outcome.name == "dead_centre"
