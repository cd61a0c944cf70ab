"""Hanging chains of point masses on rods without mass: their oscillations are known in closed form."""

from __future__ import annotations

from trunnion.scene.data_classes import scene as sm

GRAVITY, LENGTH, MASS = 9.81, 1.0, 2.0
POINT = 1e-12
"""Inertia of a body, kg m². It cannot be zero, and changes frequencies by 1e-12 of their values."""


def chain(n: int, start: float = 0.0, rub: dict[int, sm.Friction] | None = None) -> sm.Scene:
    """n masses, one below the other. rub: friction of some joints."""
    bodies, joints = {}, {}
    for i in range(n):
        bodies[f"b{i}"] = sm.Body(mass=MASS, inertia=(POINT,) * 3, points={"tip": (0.0, 0.0, -LENGTH)}, center=(0.0, 0.0, -LENGTH))
        inboard = f"b{i - 1}.tip" if i else "ground"
        friction = (rub or {}).get(i)
        joints[f"j{i}"] = sm.Joint("revolute", inboard, f"b{i}", axis="y", friction=friction, start=sm.Start(q=start))
    return sm.Scene(bodies, joints, "chain", gravity=(0.0, 0.0, -GRAVITY))
