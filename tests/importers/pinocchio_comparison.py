"""Comparison of an imported URDF with Pinocchio: accelerations at random states, without friction, limits and mimics."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tests.importers.mujoco_comparison import Both, Compared, accelerations, evaluable, relative
from trunnion.importers import scene_of_urdf
from trunnion.importers.intermediate_linkage import Names
from trunnion.importers.pose_matrices import of_quaternion
from trunnion.scene.data_classes.scene import Scene


def opened(scene: Scene) -> Scene:
    """The scene without friction and couplings, which Pinocchio's forward dynamics does not support."""
    joints = {n: replace(j, friction=None, start=None, mimic=None) for n, j in scene.joints.items()}
    return replace(scene, joints=joints)


def compared(file: Path, seeds: int = 3) -> Compared:
    """The file's mechanism in Trunnion and in Pinocchio. SceneError if Trunnion refuses the file; ValueError if Pinocchio refuses
    it."""
    import pinocchio as pin

    scene, notes = scene_of_urdf(file)
    m = pin.buildModelFromUrdf(str(file))
    data, ours = m.createData(), evaluable(opened(scene))
    named = _scene_names(m, scene)
    both: list[Both] = []
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        q, v = pin.integrate(m, pin.neutral(m), 0.5 * rng.normal(size=m.nv)), rng.normal(size=m.nv)
        a = pin.aba(m, data, q, v, -np.asarray(m.damping) * v)
        states = [_coordinates(m, named, q, v, a, i) for i in range(1, m.njoints)]
        mine = accelerations(ours, {n: s[0] for n, s in states}, {n: s[1] for n, s in states})
        both.append((np.concatenate(list(mine.values())), np.concatenate([s[2] for _, s in states]), v))
    gap = relative(both)
    return Compared(len(scene.bodies), m.nv, 0, gap, 0.0, gap, tuple(notes))


def _scene_names(m: Any, scene: Scene) -> dict[str, str]:
    """Name of the scene's joint for each joint of the file."""
    out = {}
    for name in list(m.names)[1:]:
        plain = Names().new(name, "joint")
        tries = [plain, f"{plain}_joint"]
        out[name] = next(n for n in tries if n in scene.joints and scene.joints[n].type != "fixed")
    return out


def _coordinates(
    m: Any, named: dict[str, str], q: np.ndarray, v: np.ndarray, a: np.ndarray, i: int
) -> tuple[str, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """(the scene's joint, its coordinates, rates and accelerations). Pinocchio gives a continuous joint by cosine and sine, and the
    rates of a floating joint in the axes of the moving body."""
    joint, at, go = m.joints[i], m.joints[i].idx_q, m.joints[i].idx_v
    own, rate, acc = q[at : at + joint.nq], v[go : go + joint.nv], a[go : go + joint.nv]
    if joint.nq == 2:
        own = np.array([np.arctan2(own[1], own[0])])
    elif joint.nq == 7:
        R = of_quaternion([own[6], *own[3:6]])
        own = np.array([*own[:3], own[6], *own[3:6]])
        acc = np.array([*(R @ (acc[:3] + np.cross(rate[3:], rate[:3]))), *(R @ acc[3:])])
        rate = np.array([*(R @ rate[:3]), *(R @ rate[3:])])
    elif joint.nq == 4:
        raise ValueError("Pinocchio ignores the axis of a planar joint")
    return named[m.names[i]], (own, rate, acc)
