"""States of the reference, computed from the columns of a run: states of its rows, and of an instant after a row."""

from __future__ import annotations

import numpy as np

from tests.reference.mechanics.joint_constraints import freedoms, of
from tests.reference.mechanics.kinematics import State, forward
from tests.reference.mechanics.rotation import cross


def wanted(scene) -> tuple[str, ...]:
    """Names of the columns of states, accelerations, frictions and energy."""
    out = ["energy.*"]
    for name, joint in scene.joints.items():
        n = freedoms(joint.type)
        out += [f"{name}.q[{k + 1}]" for k in range(n + of(joint.type).ball)]
        out += [f"{name}.{x}[{k + 1}]" for x in ("qd", "qdd") for k in range(n)]
        out += [f"{name}.friction.{x}" for x in _frictions(joint)]
    return tuple(out)


def _frictions(joint) -> list[str]:
    """The columns of a joint's friction, in the order of its freedoms."""
    if joint.friction is None:
        return []
    directions = of(joint.type).free
    turns = [d for d in directions if d >= 3]
    return ["force"] * (len(turns) < len(directions)) + [f"torque[{k + 1}]" for k in range(len(turns))]


def column(result, name: str, what: str, row: int) -> np.ndarray:
    """q, qd or qdd of a joint in a row."""
    joint = result.scene.joints[name]
    n = freedoms(joint.type) + (of(joint.type).ball if what == "q" else 0)
    return np.array([result[f"{name}.{what}[{k + 1}]"][row] for k in range(n)])


def frictions(result, row: int) -> np.ndarray:
    """η of all joints with friction, in a row."""
    joints = result.scene.joints.items()
    return np.array([result[f"{n}.friction.{x}"][row] for n, j in joints for x in _frictions(j)])


def state_at(result, row: int, ahead: float = 0.0, still: frozenset[tuple[str, int]] = frozenset()) -> State:
    """The state of a row, or the state ``ahead`` seconds after the row with constant accelerations. ``still``: joints and numbers
    of freedoms that are at rest."""
    joints = [n for n, j in result.scene.joints.items() if freedoms(j.type)]
    q, qd, qdd = ({n: column(result, n, what, row) for n in joints} for what in ("q", "qd", "qdd"))
    for n, k in still:
        qd[n][k] = qdd[n][k] = 0.0
    for n in joints:
        q[n] = _moved(result.scene.joints[n].type, q[n], ahead * qd[n] + 0.5 * ahead**2 * qdd[n])
        qd[n] = qd[n] + ahead * qdd[n]
    return forward(result.scene, q, qd, float(result.time[row]) + ahead)


def _moved(kind: str, q: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Coordinates after a small step along the freedoms; a ball turns about axes of its inboard side."""
    k = of(kind).scalars
    if not of(kind).ball:
        return q + step
    w, v, turn = q[k], q[k + 1 :], step[k:] / 2
    ball = np.r_[w - turn @ v, v + w * turn + cross(turn, v)]
    return np.r_[q[:k] + step[:k], ball / np.linalg.norm(ball)]
