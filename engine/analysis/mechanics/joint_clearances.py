"""Clearances of joints: directions in which the parts of a joint with clearance can move, and the mobility in these directions
(theory, "Clearance")."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from trunnion.analysis.mechanics.state_evaluation import evaluate
from trunnion.elements.contact import REGISTRY as CONTACTS
from trunnion.elements.contact.clearance import Play
from trunnion.elements.joints import REGISTRY
from trunnion.elements.joints.declaration_checks import Numeric
from trunnion.elements.joints.free import FREE
from trunnion.elements.joints.joint_kind import E2, to_quaternion
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import Model

LEFT_OUT = ("friction", "ends", "effort", "spring", "damping", "end_stops", "latch", "motor", "wear", "start")
"""Keys of joints that do not affect the acceleration caused by a force."""
STIFF = 1e-9
"""A mobility along locked directions counts as zero below this multiple of the largest such mobility."""


def clearances_of(j: sm.Joint) -> tuple[Play, ...]:
    """The clearances of a joint; empty if crossings of its clearance cannot be computed."""
    element = REGISTRY[j.type].friction
    return CONTACTS[element].plays if element else ()


def frame_of(play: Play, R: np.ndarray) -> np.ndarray:
    """Axes of the bearing's frame in the inboard joint frame (3×3). R: outboard to inboard joint frame (3×3)."""
    return np.eye(3) if play.side == "in" else R


def directions(names: Sequence[str], R: np.ndarray) -> np.ndarray:
    """The directions of a ``Play`` in the inboard joint frame (3×n)."""
    known = dict(zip(("e1", "e2", "e3"), np.eye(3), strict=True)) | {"u2": R[:, E2], "u3": np.cross([1.0, 0.0, 0.0], R[:, E2])}
    return np.array([known[n] for n in names]).reshape(-1, 3).T


def rotation_at(r: Result, name: str, row: int) -> np.ndarray:
    """The rotation matrix R of a joint at a row of the result, from the outboard to the inboard joint frame (3×3)."""
    q = [float(r[c][row]) for c in r.matching(f"{name}.q[*]")]
    return np.array(REGISTRY[r.scene.joints[name].type].rotation(q, Numeric), float)


def restrict_mobility(B: np.ndarray, play: Play, R: np.ndarray) -> np.ndarray:
    """The mobility in the directions of a clearance (3×3, inboard joint frame). B: mobility of the free joint (6×6)."""
    axes = frame_of(play, R)[:, list(play.axes)]
    ways, turns = directions(play.ways, R), directions(play.turns, R)
    moves = np.vstack([axes, np.zeros_like(axes)])
    locks = np.block([[ways, np.zeros_like(turns)], [np.zeros_like(ways), turns]])
    inner, cross = locks.T @ B @ locks, moves.T @ B @ locks
    own = moves.T @ B @ moves - cross @ np.linalg.pinv(inner, rcond=STIFF, hermitian=True) @ cross.T
    return np.asarray(axes @ own @ axes.T)


def free_mobility(r: Result, name: str) -> Callable[[int], np.ndarray]:
    """A function from the index of a row to the mobility of the free joint (6×6, inboard joint frame). The mobility maps a force
    and torque between the parts of the joint to the parts' relative acceleration, in the mechanism without the joint."""
    bare: dict[str, Any] = dict.fromkeys(LEFT_OUT)
    joints = {n: replace(x, **bare) for n, x in r.scene.joints.items()}
    own = replace(joints[name], type=FREE.name, effort=(1.0,) * 6, drive=None, cut=False)
    scene = replace(r.scene, joints=joints | {name: own}, forces={}, gravity=(0.0, 0.0, 0.0))
    model = Model(scene, (f"{name}.qdd[*]",))
    efforts = [model.built.parameters.paths.index(f"joints.{name}.effort[{k + 1}]") for k in range(6)]

    def accelerations(load: np.ndarray, q: Mapping[str, Sequence[float]], t: float) -> list[float]:
        model.block.parameters[efforts] = load
        model.block.prepare()
        found = evaluate(model, q, {}, t)
        return [found[f"{name}.qdd[{k + 1}]"] for k in range(6)]

    def at(row: int) -> np.ndarray:
        q: dict[str, Sequence[float]] = {n: [r[c][row] for c in r.matching(f"{n}.q[*]")] for n in joints}
        kind = REGISTRY[r.scene.joints[name].type]
        R = kind.rotation(q[name], Numeric)
        q[name] = [*kind.travel(q[name]), *to_quaternion(R, Numeric)]
        each = np.array([accelerations(load, q, float(r.time[row])) for load in np.vstack([np.zeros(6), np.eye(6)])])
        return (each[1:] - each[0]).T

    return at
