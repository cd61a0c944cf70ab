"""Random trees and loops of any size with friction in every joint. Tests use them for decisions to stick and for stick itself."""

from __future__ import annotations

from dataclasses import replace

from tests.reference.scenes.random_components import RUBBING_TYPES
from tests.reference.scenes.random_scenes import Case, random_loop, random_tree
from tests.reference.scenes.random_streams import stream
from tests.reference.scenes.unit_changes import rescaled
from trunnion.scene.data_classes import scene as sm

DRY = {"friction": 1.0, "devices": 0.0, "drives": 0.0, "loads": False, "laws": ("coulomb",), "adams": 0.0, "types": RUBBING_TYPES}


def rubbing(kind: str, seed: int, most: float = 1.0) -> Case:
    """A tree or a loop of 1 to 6 bodies. Every joint whose type can have friction has μ from 0 to ``most`` and μ_static up to 1.5
    μ. Lengths are multiplied by 1e-3 to 1e3 and masses by 1e-6 to 1e6. Time is scaled so that gravity keeps its value."""
    made = {"tree": random_tree, "loop": random_loop}[kind](f"rubbing {seed}", **DRY)
    joints = {n: _rough(j, seed, n, most) for n, j in made.scene.joints.items()}
    case = replace(made, scene=replace(made.scene, joints=joints))
    size = stream(seed, kind, "size")
    length, mass = 10.0 ** size.uniform(-3, 3), 10.0 ** size.uniform(-6, 6)
    return rescaled(case, length, mass, length**0.5).case


def _rough(joint: sm.Joint, seed: int, name: str, most: float) -> sm.Joint:
    """The joint with its own coefficients."""
    if joint.friction is None:
        return joint
    rng = stream(seed, name, "rough")
    mu = float(rng.uniform(0.0, most))
    static = mu * float(rng.uniform(1.0, 1.5)) if rng.random() < 0.5 else None
    return replace(joint, friction=replace(joint.friction, mu=mu, mu_static=static))
