"""Planets in parallel press the sun's bearing by a share that statics leaves open. The sun sticks, begins to slip and slips on:
its bearing's loads are those of stiff contacts at rest as while sliding, so no load jumps and no mode is missing between them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.reference.scenes.random_streams import stream
from trunnion import Scene, scene_from_dict, simulate

NEAR = 1e-7
"""Time before and after an onset, s, in which loads change by far less than they jumped."""
FLOOR = 1e-6
"""Error of a run with rtol 1e-8, rad: the angles are of order 10."""
SMOOTH = (2e-5, 1e-5)
"""Speeds at which the smoothed law saturates, m/s; the error of its motion is in proportion, so that two give the limit."""


def train(seed: int, planets: int) -> dict[str, Any]:
    """An epicyclic train with a torque on its ring that grows until the sun slips. Seeds draw sizes, masses and what rubs."""
    rng = stream(seed, str(planets), "planets")
    sun, planet, module = int(rng.integers(16, 30)), int(rng.integers(16, 30)), 4e-3
    arm, angles = (sun + planet) * module / 2, 2 * np.pi * np.arange(planets) / planets
    at = [[float(arm * np.cos(a)), float(arm * np.sin(a)), 0.0] for a in angles]
    origin = [0.0, 0.0, 0.0]

    def body(mass: float, radius: float, **more: Any) -> dict[str, Any]:
        j = 0.5 * mass * radius**2
        return {"mass": mass, "inertia": [j / 2, j / 2, j], "position": origin} | more

    ratio = (sun + 2 * planet) / sun
    size = float(rng.uniform(0.5, 2.0))
    center = [float(x) for x in rng.uniform(-0.02, 0.02, 2)] + [0.0]
    bodies = {"sun": body(0.5, 0.04), "ring": body(2.0, 0.13), "car": body(1.0, arm, center=center)}
    joints: dict[str, Any] = {
        "rsun": {"inboard": "ground", "outboard": "sun", "at": origin,
                 "friction": {"mu": float(rng.uniform(0.2, 0.6)), "radius": 0.015, "half_length": 0.05}},
        "rring": {"inboard": "ground", "outboard": "ring", "at": origin,
                  "effort": {"ramp": {"start": 0, "end": size, "duration": 1}}},
        "rcar": {"inboard": "ground", "outboard": "car", "at": origin, "damping": float(rng.uniform(0.0, 0.3)) * ratio},
    }  # fmt: skip
    for i, place in enumerate(at):
        bodies[f"p{i}"] = body(float(rng.uniform(0.2, 0.5)), planet * module / 2) | {"position": place}
        rubs = {"friction": {"torque": float(rng.uniform(0.002, 0.02))}} if rng.random() < 0.6 else {}
        joints[f"rp{i}"] = {"inboard": "car", "outboard": f"p{i}", "at": place} | rubs
        joints[f"gs{i}"] = {"type": "gear", "inboard": "sun", "outboard": f"p{i}", "teeth": [sun, planet], "module": module}
        joints[f"gr{i}"] = {"type": "gear", "inboard": f"p{i}", "outboard": "ring", "teeth": [planet, sun + 2 * planet],
                            "module": module, "internal": True}  # fmt: skip
    joints = {n: {"type": "revolute", "axis": "z"} | j for n, j in joints.items()}
    return {"gravity": [0, -9.81, 0], "bodies": bodies, "joints": joints, "simulation": {"until": 1.0}}


def smoothed(scene: Scene, v_eps: float) -> Scene:
    """The train whose sun rubs by the smoothed law."""
    sun = scene.joints["rsun"]
    assert sun.friction is not None
    rubs = replace(sun.friction, law="regularized", v_eps=v_eps)
    return replace(scene, joints=scene.joints | {"rsun": replace(sun, friction=rubs)})


@pytest.mark.parametrize("planets", [2, 3, 4])
def test_a_sun_held_by_its_bearing_slips_on(planets: int) -> None:
    slipped = 0
    for seed in range(5):
        r = simulate(scene_from_dict(train(seed, planets)))
        assert r.outcome.ok, (seed, r.outcome)
        slipped += any(e.kind == "slip" and e.joint == "rsun" for e in r.events)
    assert slipped >= 2


@pytest.mark.parametrize("planets", [2, 4])
def test_loads_do_not_jump_where_the_sun_begins_to_slip(planets: int) -> None:
    found = 0
    for seed in range(4):
        scene = scene_from_dict(train(seed, planets))
        r = simulate(scene)
        for event in [e for e in r.events if e.kind == "slip" and e.joint == "rsun"][:1]:
            before, after = (
                simulate(scene, until=t, every=t, outputs=["rsun.contact*.normal_force"])
                for t in (event.time - NEAR, event.time + NEAR)
            )
            for name in (c.name for c in before.columns if c.name.startswith("rsun")):
                assert after[name][-1] == pytest.approx(before[name][-1], rel=1e-4), (seed, name)  # a jump was 1 to 5 %
                found += 1
    assert found >= 4


@pytest.mark.parametrize("seed", range(4))
def test_the_motion_is_the_limit_of_the_smoothed_law(seed: int) -> None:
    """A sun that creeps instead of sticking turns by about its largest speed at rest times the time at rest."""
    scene = scene_from_dict(train(seed, 3))
    exact = simulate(scene, rtol=1e-8)["rsun.q[1]"][-1]
    coarse, fine = (simulate(smoothed(scene, v), method="rosenbrock", rtol=1e-8)["rsun.q[1]"][-1] for v in SMOOTH)
    assert abs(fine - exact) < 0.6 * abs(coarse - exact) + FLOOR
    assert abs(2 * fine - coarse - exact) <= 0.05 * abs(coarse - exact) + FLOOR
