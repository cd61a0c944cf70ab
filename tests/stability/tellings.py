"""A scene told otherwise: the world turned at random, or every length, mass and time in other units."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from engine.scene import model as sm
from tests.reference.joint_rows import freedoms
from tests.reference.random_scenes import Case
from tests.reference.transforms import rotated
from tests.reference.units import rescaled

TELLINGS = ("as written", "turned", "millimetres and grams")
LENGTH, MASS, TIME = 1000.0, 1e-3, 10.0


def told(scene: sm.Scene, how: str, seed: int = 0) -> sm.Scene:
    """The scene in another telling."""
    if how == "turned":
        return rotated(_case(scene), seed).case.scene
    if how == "millimetres and grams":
        moved = rescaled(_case(scene), LENGTH, MASS, TIME).case.scene
        return replace(moved, simulation=replace(scene.simulation, until=TIME * float(scene.simulation.until)))
    return scene


def _case(scene: sm.Scene) -> Case:
    q, qd = {}, {}
    for name, joint in scene.joints.items():
        start = joint.start
        if start is None or start.q is None:
            continue
        q[name] = _coordinates(start.q)
        rates = np.zeros(freedoms(joint.type)) if start.qd is None else np.atleast_1d(np.array(start.qd, float))
        qd[name] = rates
    return Case(scene, q, qd, 0.0, tuple(q))


def _coordinates(q) -> np.ndarray:
    if isinstance(q, sm.AxisAngle):
        from tests.reference.bodies import direction

        half = float(q.angle) / 2
        return np.r_[np.cos(half), np.sin(half) * direction(q.axis)]
    return np.atleast_1d(np.array(q, float))
