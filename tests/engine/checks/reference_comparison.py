"""The engine's columns in the form of the reference's table, so that the two can be compared."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tests.reference.mechanics.kinematics import State
from tests.reference.mechanics.rotation import matrix_from_quaternion
from tests.reference.scenes.random_scenes import Case
from trunnion.analysis.mechanics.state_evaluation import evaluate
from trunnion.simulation.run import Model

Table = dict[tuple[str, str], np.ndarray]


def engine_row(case: Case, outputs: tuple[str, ...] = ("*",)) -> tuple[Model, dict[str, float]]:
    """The engine's columns at the case's state as name → value."""
    model = Model(case.scene, outputs)
    return model, evaluate(model, case.q, case.qd, case.t)


def take(row: Mapping[str, float], prefix: str) -> np.ndarray:
    """The columns prefix[1], prefix[2], … that exist."""
    values = []
    while f"{prefix}[{len(values) + 1}]" in row:
        values.append(row[f"{prefix}[{len(values) + 1}]"])
    return np.array(values)


def engine_table(case: Case) -> Table:
    """The engine's results at the case's state with the keys of ``tests.reference.scenes.result_table.table``."""
    return results(*engine_row(case))


def results(model: Model, row: Mapping[str, float]) -> Table:
    """The numbers of ``tests.reference.scenes.result_table.table``, from a row of the engine (without angular accelerations)."""
    out: Table = {("energy", "kinetic"): np.array(row["energy.kinetic"])}
    for j in model.system.joints:
        name, kind = j.name, j.kind
        out[name, "qdd"] = take(row, f"{name}.qdd")
        if kind.nv < 6:
            out[name, "reaction.force"] = take(row, f"{name}.reaction.force")
            out[name, "reaction.torque"] = take(row, f"{name}.reaction.torque")
        if j.driven:
            efforts = [row.get(f"{name}.drive.effort[{k + 1}]", np.nan) for k in range(kind.nv)]
            out[name, "drive.effort"] = np.array(efforts)
        if j.friction:
            turn, friction = iter(take(row, f"{name}.friction.torque")), []
            for k in range(kind.nv):
                friction.append(next(turn) if kind.turns(k) else row[f"{name}.friction.force"])
            out[name, "friction"] = np.array(friction)
            n = 1
            force, normal, angle = [], [], []
            while f"{name}.contact[{n}].normal_force" in row:
                c = f"{name}.contact[{n}]"
                force.append(row[f"{c}.normal_force"])
                normal.append(take(row, f"{c}.normal"))
                angle.append(row[f"{c}.angle"])
                n += 1
            out[name, "normal_force"], out[name, "normal"], out[name, "angle"] = np.array(force), np.array(normal), np.array(angle)
    for b in model.system.bodies:
        out[b.name, "acceleration"] = take(row, f"{b.name}.acceleration")
    return out


def motion(model: Model, row: Mapping[str, float]) -> Table:
    """Positions and velocities of all bodies and joints, from a row of the engine; quaternions as matrices (their sign is free)."""
    out: Table = {}
    for j in model.system.joints:
        q = take(row, f"{j.name}.q")
        if j.kind.quaternion >= 0:
            q = np.r_[q[: j.kind.quaternion], matrix_from_quaternion(q[j.kind.quaternion :]).ravel()]
        angles = [i for i, c in enumerate(j.kind.coordinates) if c == "angle" and j.cut]
        out[j.name, "q"] = np.r_[q, np.sin(q[angles]), np.cos(q[angles])]
        out[j.name, "q"][angles] = 0.0
        out[j.name, "qd"] = take(row, f"{j.name}.qd")
    for b in model.system.bodies:
        for quantity in ("position", "velocity", "angular_velocity"):
            out[b.name, quantity] = take(row, f"{b.name}.{quantity}")
        out[b.name, "orientation"] = matrix_from_quaternion(take(row, f"{b.name}.orientation"))
        for point, _ in b.points:
            out[b.name, point] = take(row, f"{b.name}.{point}.position")
    return out


def reference_motion(model: Model, state: State) -> Table:
    """The quantities of ``motion``, computed from the reference's state."""
    out: Table = {}
    for j in model.system.joints:
        q = state.q[j.name]
        if j.kind.quaternion >= 0:
            q = np.r_[q[: j.kind.quaternion], matrix_from_quaternion(q[j.kind.quaternion :]).ravel()]
        angles = [i for i, c in enumerate(j.kind.coordinates) if c == "angle" and j.cut]
        out[j.name, "q"] = np.r_[q, np.sin(q[angles]), np.cos(q[angles])]
        out[j.name, "q"][angles] = 0.0
        out[j.name, "qd"] = state.qd[j.name]
    for b in model.system.bodies:
        out[b.name, "position"], out[b.name, "velocity"] = state.c[b.name], state.v[b.name]
        out[b.name, "angular_velocity"], out[b.name, "orientation"] = state.omega[b.name], state.R[b.name]
        for point, _ in b.points:
            out[b.name, point] = state.point(b.name, state.scene.bodies[b.name].points[point])[0]
    return out


def worst(expected: Table, got: Table, without: tuple[str, ...] = ()) -> tuple[float, tuple[str, str] | None]:
    """Largest difference over all quantities of ``expected`` except ``without``, relative to the largest entry of the quantity, and
    its place. Angles are compared by sine and cosine. NaN in ``expected`` means an undefined value; NaN or a missing value in
    ``got`` counts as an infinite difference."""
    size: dict[str, float] = {}
    for (_, quantity), value in expected.items():
        if quantity != "angle":
            size[quantity] = max(size.get(quantity, 1.0), float(np.nanmax(np.abs(value), initial=0.0)))
    most, where = 0.0, None
    for key, value in expected.items():
        if key[1] in without:
            continue
        x, y = np.asarray(value, float), np.asarray(got.get(key, np.full(np.shape(value), np.inf)), float)
        if key[1] == "angle":
            x, y = np.exp(1j * x), np.exp(1j * np.where(np.isfinite(y), y, np.nan))
        gap = np.where(np.isnan(x), 0.0, np.abs(x - y)) if x.shape == y.shape else np.array(np.inf)
        gap = float(np.max(np.where(np.isnan(gap), np.inf, gap), initial=0.0)) / size.get(key[1], 1.0)
        if gap > most:
            most, where = gap, key
    return most, where
