"""Scenes and runs with dry friction: example 8.1 released at an angle, and an arm of six bars on revolutes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from trunnion.scene import load_scene
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.overrides import apply
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate

DRY = {"friction.law": "coulomb"}


def run(
    scene: sm.Scene | str,
    until: float,
    every: float,
    rtol: float = 1e-9,
    max_steps: int = 1_000_000,
    outputs: tuple[str, ...] = ("*",),
    **changes,
) -> Result:
    """Run a scene to its end, which the run must reach. changes: ``path__to__number=value``."""
    overrides = {**DRY, **{k.replace("__", "."): v for k, v in changes.items()}}
    r = simulate(scene, until=until, every=every, rtol=rtol, max_steps=max_steps, outputs=outputs, overrides=overrides)
    assert r.outcome.ok, r.outcome
    return r


def pendulum_angle(r: Result) -> np.ndarray:
    """Angle of example 8.1's pendulum from the downward vertical, degrees."""
    return np.degrees(np.arctan2(r["pendulum.position[1]"], -r["pendulum.position[3]"]))


def pendulum_at(degrees: float, every: float, until: float, rtol: float = 1e-9, **friction) -> Result:
    """Example 8.1 released from rest at an angle from the downward vertical."""
    scene = apply(load_scene("spherical_pendulum"), {"joints.ball.start.q": {"axis": "y", "angle": math.radians(90.0 - degrees)}})
    joint = scene.joints["ball"]
    assert joint.friction is not None
    rub = replace(joint.friction, **friction)
    return run(replace(scene, joints={"ball": replace(joint, friction=rub)}), until, every, rtol)


ARM_AXES = ("z", "y", "x", "y", "x", "z")


def arm(tilt: float, mu: float = 0.3, mu_static: float | None = None, load: sm.Applied | None = None) -> sm.Scene:
    """Six bars of 0.3 m on top of each other on revolutes with friction about z, y, x, y, x, z. Each is inclined by ``tilt`` (rad)
    in alternating sense; weight acts along −z."""
    length, rub = 0.3, sm.Friction(mu=mu, mu_static=mu_static, radius=0.05, half_length=0.1)
    points = {"a": (0.0, 0.0, -length / 2), "b": (0.0, 0.0, length / 2)}
    bodies = {f"b{k}": sm.Body(box=(0.05, 0.05, length), density=2700.0, points=points) for k in range(1, 7)}
    joints = {
        f"j{k}": sm.Joint("revolute", "ground" if k == 1 else f"b{k - 1}.b", f"b{k}.a", axis=ARM_AXES[k - 1], friction=rub,
                          start=sm.Start(tilt * (-1) ** (k - 1), 0.0))
        for k in range(1, 7)
    }  # fmt: skip
    return sm.Scene(bodies, joints, "arm", gravity=(0.0, 0.0, -9.81), forces={} if load is None else {"load": load})
