"""Comparison of an imported MJCF with MuJoCo: accelerations at random states. Constraints, contacts and actuators are off in
MuJoCo."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from trunnion.analysis.mechanics.state_evaluation import evaluate
from trunnion.importers.mjcf.bodies import BodyConverter
from trunnion.importers.mjcf.joints import MjcfJoint
from trunnion.importers.mjcf.scene_builder import linkage_of_mjcf
from trunnion.importers.pose_matrices import of_quaternion
from trunnion.scene.data_classes.scene import Scene
from trunnion.simulation.run import Model


@dataclass
class Compared:
    """bodies, freedoms, loops: of the scene. gap: largest difference of accelerations, relative to the largest of all states.
    inertia: largest relative difference of a body's inertia from MuJoCo's. gap_with: the remaining gap when MuJoCo has the inertias
    of the scene."""

    bodies: int
    freedoms: int
    loops: int
    gap: float
    inertia: float
    gap_with: float
    notes: tuple[str, ...]


def opened(scene: Scene, bodies: BodyConverter) -> tuple[Scene, list[str]]:
    """The scene's tree without friction, and the joints that close its loops. Constraints are off in MuJoCo."""
    made = {f.name for f in bodies.freedoms}
    carried: set[str] = set()
    closing, joints = [], {}
    for n, j in scene.joints.items():
        outboard = j.outboard if isinstance(j.outboard, str) else j.outboard.body
        if n not in made and outboard in carried:
            closing.append(n)
            continue
        carried.add(outboard)
        joints[n] = replace(j, friction=None, start=None, mimic=None)
    return replace(scene, joints=joints), closing


def quiet(m: Any, constraints: bool = False) -> Any:
    """Switch off all features of a MuJoCo model that a mechanism does not have."""
    import mujoco

    off = mujoco.mjtDisableBit
    m.opt.disableflags |= int(off.mjDSBL_CONTACT | off.mjDSBL_ACTUATION)
    if not constraints:
        m.opt.disableflags |= int(off.mjDSBL_CONSTRAINT)
    m.opt.density, m.opt.viscosity, m.opt.wind[:] = 0.0, 0.0, 0.0
    return m


def coordinates(m: Any, freedoms: list[MjcfJoint], q: np.ndarray, *rates: np.ndarray) -> list[dict[str, np.ndarray]]:
    """MuJoCo's qpos and some of qvel or qacc, converted to coordinates, rates or accelerations of the scene's joints. These have
    angular components in the inboard frame, not in the frame of the body."""
    out: list[dict[str, np.ndarray]] = [{} for _ in range(1 + len(rates))]
    for j, f in enumerate(freedoms):
        a, v, at = m.jnt_qposadr[j], m.jnt_dofadr[j], {"ball": 0, "free": 3}.get(f.type)
        size = {"ball": 4, "free": 7}.get(f.type, 1)
        out[0][f.name] = q[a : a + size] - (f.ref if at is None else 0.0)
        for values, to in zip(rates, out[1:], strict=True):
            own = values[v : v + size - (at is not None)].copy()
            if at is not None:
                own[at:] = of_quaternion(q[a + at : a + at + 4]) @ own[at:]
            to[f.name] = own
    return out


def evaluable(scene: Scene) -> Model:
    """The scene on parts, with accelerations as its columns."""
    return Model(scene, ("*.qdd[*",), kernel="parts")


def accelerations(model: Model, q: dict[str, np.ndarray], qd: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Accelerations of the joints in ``qd``."""
    row = evaluate(model, q, qd, 0.0)
    return {n: np.array([row[f"{n}.qdd[{k + 1}]"] for k in range(len(v))]) for n, v in qd.items()}


def random_state(m: Any, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Random qpos and qvel."""
    import mujoco

    rng = np.random.default_rng(seed)
    q = m.qpos0.copy()
    mujoco.mj_integratePos(m, q, 0.5 * rng.normal(size=m.nv), 1.0)
    return q, rng.normal(size=m.nv)


def compared(file: Path, seeds: int = 3) -> Compared:
    """The file's mechanism in Trunnion and in MuJoCo. SceneError if Trunnion refuses the file; ValueError if MuJoCo refuses it."""
    import mujoco

    linkage, model, bodies = linkage_of_mjcf(file)
    scene, closing = opened(linkage.scene(), bodies)
    m = quiet(mujoco.MjModel.from_xml_path(str(file)))
    assert m.njnt == len(bodies.freedoms)
    states, ours = [random_state(m, seed) for seed in range(seeds)], evaluable(scene)
    gap = relative([_both(m, ours, bodies, *s) for s in states])
    inertia = _given(m, bodies)
    again = relative([_both(m, ours, bodies, *s) for s in states])
    return Compared(len(scene.bodies), m.nv, len(closing), gap, inertia, again, tuple(model.found.notes))


Both = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Accelerations in Trunnion and in the other program, and the rates."""


def _both(m: Any, model: Model, bodies: BodyConverter, q: np.ndarray, qd: np.ndarray) -> Both:
    import mujoco

    d = mujoco.MjData(m)
    d.qpos[:], d.qvel[:] = q, qd
    mujoco.mj_forward(m, d)
    ours, rates, theirs = coordinates(m, bodies.freedoms, d.qpos, d.qvel, d.qacc)
    mine = accelerations(model, ours, rates)
    return np.concatenate(list(mine.values())), np.concatenate(list(theirs.values())), qd


def relative(states: list[Both]) -> float:
    """Largest difference of accelerations, relative to the largest acceleration of all states. If nothing accelerates, the
    difference is relative to the terms of rates."""
    size = max(float(np.abs(want).max()) for _, want, _ in states)
    of_rates = max(float(np.square(rates).max()) for *_, rates in states)
    return max(float(np.abs(mine - want).max()) for mine, want, _ in states) / (size if size > 1e-12 * of_rates else of_rates)


def _given(m: Any, bodies: BodyConverter) -> float:
    """Give MuJoCo the inertias of the scene, with principal axes to the last digit (MuJoCo's axes have errors of about 1e-8).
    Returns the largest relative difference from MuJoCo's former inertias."""
    import mujoco

    worst = 0.0
    m.body_sameframe[:], m.body_simple[:], m.dof_simplenum[:] = 0, 0, 0  # these shortcuts of MuJoCo assume principal axes
    named = {n: mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_BODY, n) for n in bodies.places if n}
    at = {named[n]: p.link for n, p in bodies.places.items() if n and np.array_equal(p.at, np.eye(4))}
    at |= {int(i): bodies.linkage.joints[f.name].outboard for i, f in zip(m.jnt_bodyid, bodies.freedoms, strict=True)}
    done = set()
    for i, link in at.items():
        # a body without mass may be fixed to another body at the same place
        if i < 1 or link not in bodies.linkage.links or link in done:
            continue
        done.add(link)
        R = of_quaternion(m.body_iquat[i])
        own = bodies.linkage.links[link].inertia
        worst = max(worst, float(np.abs(R @ np.diag(m.body_inertia[i]) @ R.T - own).max() / max(np.abs(own).max(), 1e-300)))
        moments, axes = np.linalg.eigh(own)
        axes[:, 2] *= np.sign(np.linalg.det(axes))
        mujoco.mju_mat2Quat(m.body_iquat[i], axes.ravel())
        m.body_inertia[i] = moments
    return worst
