"""An equivalent scene: the world is turned at random, or every length, mass and time is in other units."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.reference.mechanics.bodies_and_joint_frames import direction
from tests.reference.mechanics.rotation import random_rotation
from tests.reference.scenes.frame_changes import rotated, triple
from tests.reference.scenes.random_scenes import Case
from tests.reference.scenes.unit_changes import kind_of, rescaled
from trunnion.scene.data_classes import scene as sm

TELLINGS = ("as written", "turned", "millimetres and grams")
LENGTH, MASS, TIME = 1000.0, 1e-3, 10.0


def told(scene: sm.Scene, how: str, seed: int = 0, runs: bool = True) -> sm.Scene:
    """An equivalent scene. If the scene is refused as it is written (not ``runs``), its directions are turned as written."""
    if how == "turned" and not runs:
        return _written_turned(scene, random_rotation(np.random.default_rng(seed)))
    if how == "turned":
        return rotated(_case(scene), seed).case.scene
    if how == "millimetres and grams":
        moved = rescaled(_case(scene), LENGTH, MASS, TIME).case.scene
        return replace(moved, simulation=replace(scene.simulation, until=TIME * float(scene.simulation.until)))
    return scene


def _written_turned(scene: sm.Scene, Q: np.ndarray) -> sm.Scene:
    def turned(d: sm.Direction | None) -> sm.Direction | None:
        return None if d is None else triple(Q @ direction(d)) if isinstance(d, str) else triple(Q @ np.array(d, float))

    joints = {n: replace(j, axis=turned(j.axis), reference=turned(j.reference)) for n, j in scene.joints.items()}
    return replace(scene, joints=joints, gravity=triple(Q @ np.array(scene.gravity)))


def _case(scene: sm.Scene) -> Case:
    q, qd = {}, {}
    for name, joint in scene.joints.items():
        start = joint.start
        if start is None or start.q is None:
            continue
        q[name] = _coordinates(start.q)
        rates = np.zeros(len(kind_of(joint.type).free)) if start.qd is None else np.atleast_1d(np.array(start.qd, float))
        qd[name] = rates
    return Case(scene, q, qd, 0.0, tuple(q))


def _coordinates(q) -> np.ndarray:
    if isinstance(q, sm.AxisAngle):
        half = float(q.angle) / 2
        return np.r_[np.cos(half), np.sin(half) * direction(q.axis)]
    return np.atleast_1d(np.array(q, float))
