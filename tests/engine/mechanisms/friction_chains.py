"""Chains of bars at rest with friction at every joint: balls, universal joints, pins, guides and shafts in one chain."""

from __future__ import annotations

import numpy as np

from trunnion.scene.data_classes import scene as sm

SLIDE = ("prismatic", "cylindrical")
EVERY = ("spherical", "universal", "revolute", *SLIDE)


def rub(rng: np.random.Generator, kind: str, grip: float) -> sm.Friction:
    """Coulomb friction for a joint of this type, with a factor from sliding to static friction. Sliding joints have little
    friction on a long guide, so that they seldom wedge."""
    mu, radius = float(rng.uniform(0.05, 0.15 if kind in SLIDE else 0.5)), float(rng.uniform(0.005, 0.03))
    half, static = float(rng.uniform(0.5, 0.9) if kind in SLIDE else rng.uniform(0.05, 0.1)), None if grip == 1.0 else grip * mu
    if kind == "spherical":
        return sm.Friction(mu=mu, mu_static=static, radius=radius)
    if kind == "prismatic":
        return sm.Friction(mu=mu, mu_static=static, half_width=0.03, half_height=0.03, half_length=half)
    return sm.Friction(mu=mu, mu_static=static, radius=radius, half_length=half)


def start(rng: np.random.Generator, kind: str, down: float) -> sm.Start:
    """A start at rest, nearly along the previous bar, turned down by this angle (rad)."""
    one, other = rng.uniform(-0.1, 0.1, 2).tolist()
    if kind == "spherical":
        turn = np.array([np.cos(down / 2), 0.05 * rng.normal(), np.sin(down / 2) + one, 0.05 * rng.normal()])
        return sm.Start(tuple((turn / np.linalg.norm(turn)).tolist()), (0.0, 0.0, 0.0))
    if kind == "universal":
        return sm.Start((down + one, other), (0.0, 0.0))
    if kind == "cylindrical":
        return sm.Start((0.1 * one, other), (0.0, 0.0))
    return sm.Start(0.1 * one if kind == "prismatic" else down + one, 0.0)


def chain_at_rest(kinds: list[str], seed: int, grip: float = 1.0) -> sm.Scene:
    """Bars on joints of these types. They hang from the first joint, which does not slide. Sliding joints slide across the load:
    along a bar, the rest of the chain would fall freely, without load."""
    rng = np.random.default_rng([seed, len(kinds), 17])
    bodies: dict[str, sm.Body] = {}
    joints: dict[str, sm.Joint] = {}
    for k, kind in enumerate(kinds):
        length, axis = float(rng.uniform(0.2, 0.4)), None if kind == "spherical" else "z" if kind in SLIDE else "y"
        ends = {"a": (-length / 2, 0.0, 0.0), "b": (length / 2, 0.0, 0.0)}
        bodies[f"b{k}"] = sm.Body(box=(length, 0.06, 0.04), density=2700.0, points=ends)
        inboard, pin = "ground" if k == 0 else f"b{k - 1}.b", "inboard" if rng.random() < 0.5 else "outboard"
        common = {"friction": rub(rng, kind, grip), "start": start(rng, kind, 0.0 if k else np.pi / 2), "pin": pin}
        joints[f"j{k}"] = sm.Joint(kind, inboard, f"b{k}.a", **common, **({} if axis is None else {"axis": axis}))
    return sm.Scene(bodies, joints, f"chain_{len(kinds)}_{seed}", gravity=(0.0, 0.0, -9.81))


def mixed(count: int, seed: int, grip: float = 1.0) -> sm.Scene:
    """A chain of ``count`` bars on joints of random types."""
    rng = np.random.default_rng([seed, count])
    return chain_at_rest([str(rng.choice(EVERY if k else EVERY[:3])) for k in range(count)], seed, grip)


def balls(count: int, seed: int) -> sm.Scene:
    """A chain of ``count`` bars on balls."""
    return chain_at_rest(["spherical"] * count, seed)
