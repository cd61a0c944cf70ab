"""The engine's columns in the reference's table form, so that the two can be laid side by side."""

from __future__ import annotations

import numpy as np
from tests.reference.random_scenes import Case

from engine.simulate.evaluate import evaluate
from engine.simulate.run import Model


def engine_table(case: Case) -> dict[tuple[str, str], np.ndarray]:
    """Engine results at the case's state, keyed as ``tests.reference.values.table``."""
    model = Model(case.scene, ["*"])
    row = evaluate(model, case.q, case.qd, case.t)

    def take(prefix: str) -> np.ndarray:
        values = []
        while f"{prefix}[{len(values) + 1}]" in row:
            values.append(row[f"{prefix}[{len(values) + 1}]"])
        return np.array(values)

    out: dict[tuple[str, str], np.ndarray] = {("energy", "kinetic"): np.array(row["energy.kinetic"])}
    for j in model.system.joints:
        name, kind = j.name, j.kind
        out[name, "qdd"] = take(f"{name}.qdd")
        if kind.name != "free":
            out[name, "reaction.force"], out[name, "reaction.torque"] = take(f"{name}.reaction.force"), take(f"{name}.reaction.torque")
        if j.driven:
            efforts = [row.get(f"{name}.drive.effort[{k + 1}]", np.nan) for k in range(kind.nv)]
            out[name, "drive.effort"] = np.array(efforts)
        if j.friction:
            turn, friction = iter(take(f"{name}.friction.torque")), []
            for column in kind.columns:
                friction.append(next(turn) if column[0].rot else row[f"{name}.friction.force"])
            out[name, "friction"] = np.array(friction)
            n = 1
            force, normal, angle = [], [], []
            while f"{name}.contact[{n}].normal_force" in row:
                c = f"{name}.contact[{n}]"
                force.append(row[f"{c}.normal_force"])
                normal.append(take(f"{c}.normal"))
                angle.append(row[f"{c}.angle"])
                n += 1
            out[name, "normal_force"], out[name, "normal"], out[name, "angle"] = np.array(force), np.array(normal), np.array(angle)
    for b in model.system.bodies:
        out[b.name, "acceleration"] = take(f"{b.name}.acceleration")
    return out
