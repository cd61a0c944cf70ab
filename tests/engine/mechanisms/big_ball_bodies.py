"""Bodies that hang on ball joints of large radius and large friction, which reach their friction cones repeatedly."""

from __future__ import annotations

from tests.reference.scenes.random_streams import stream
from trunnion.scene.data_classes import scene as sm


def big_balls(count: int, seed: int, law: str, v_eps: float = 1e-4) -> sm.Scene:
    """A chain of ``count`` tumbling boxes b0, b1, … on big balls j0, j1, …"""
    rng = stream("big ball", seed) if count == 1 else stream("big balls", count, seed)
    bodies, joints = {}, {}
    for i in range(count):
        points = {p: tuple(float(x) for x in rng.uniform(-0.5, 0.5, 3)) for p in ("a", "b")[: 1 + (i + 1 < count)]}
        box = tuple(float(x) for x in rng.uniform(0.1, 0.6, 3))
        bodies[f"b{i}"] = sm.Body(box=box, density=float(rng.uniform(300, 8000)), points=points)
        rub = sm.Friction(mu=float(rng.uniform(0.2, 0.8)), radius=float(rng.uniform(0.075, 0.2)))
        start = sm.Start(tuple(map(float, rng.normal(size=4))), tuple(map(float, rng.normal(size=3) * rng.choice([0.5, 3, 10]))))
        joints[f"j{i}"] = sm.Joint("spherical", f"b{i - 1}.b" if i else "ground", f"b{i}.a", friction=rub, start=start)
    gravity = tuple(float(x) for x in 6 * rng.normal(size=3))
    return sm.Scene(bodies, joints, gravity=gravity, friction=sm.FrictionDefaults(law=law, v_eps=v_eps))
