"""What MuJoCo does at the gallery's rows about roots that fold away, shared loads and events on their edge, for the table of
``stability``."""

from __future__ import annotations

import math

import mujoco
import numpy as np

from tests.benchmarks.stability_mujoco import lump, one
from tests.stability.brakes import ARM, GRIPS, MU, PRESS, REACH, SPIN
from tests.stability.row import EDGE
from tests.stability.shares import BLOCK, DOOR, MU_TABLE, SPACING, SPRING, G
from tests.stability.shares import REACH as OUT


def fold() -> str:
    """Row 23, the least torque at which the ball rubs: the friction loss of the ball is that of the root which folds away."""
    side = ARM * MU * PRESS / math.sqrt(ARM**2 - REACH**2)
    loss, forces = REACH * math.sqrt(side**2 - (MU * PRESS) ** 2), []
    lever = f'<body name="lever"><joint type="hinge" axis="0 0 1" frictionloss="{loss}"/>{lump(1, 0.01, 0.01)}</body>'
    for beyond in (-EDGE, EDGE):
        xml = (
            '<mujoco><option timestep="1e-4" gravity="0 0 0"/><worldbody><body><joint type="hinge" axis="0 0 1"/>'
            f'{lump(2, 0.05, 0.02)}{lever}</body></worldbody><equality><connect body1="lever" body2="world" anchor="{-ARM} 0 0"/>'
            "</equality></mujoco>"
        )
        model = mujoco.MjModel.from_xml_string(xml)
        data = mujoco.MjData(model)
        data.qvel[:] = SPIN, -SPIN
        data.xfrc_applied[2, 5] = (1 - beyond) * GRIPS
        mujoco.mj_step(model, data, nstep=3000)
        rows = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
        forces.append(float(data.efc_force[rows][1]))
    right = GRIPS / ARM
    return (
        f"friction loss of the ball for the threshold: the seat carries {forces[0]:.1f} N above and {forces[1]:.1f} N beyond it "
        f"(right: {side:.1f} and {right:.1f})"
    )


def door() -> str:
    """Row 24: a hinge in the tree, the other as a point constraint; how much of the weight's couple that carries."""
    body = f'<inertial pos="{OUT} 0 {SPACING / 2}" mass="{DOOR}" diaginertia="10 12 2"/>'
    xml = (
        f'<mujoco><option timestep="1e-3" gravity="0 0 -{G}"/><worldbody><body name="door"><joint type="hinge" axis="0 0 1"/>{body}'
        f'</body></worldbody><equality><connect body1="door" body2="world" anchor="0 0 {SPACING}"/></equality></mujoco>'
    )
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=1000)
    rows = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
    carried = float(np.abs(data.efc_force[rows]).max(initial=0.0))
    return f"second hinge as a soft constraint: it carries {carried:.1g} N of {DOOR * G * OUT / SPACING:.0f} N"


def marginal() -> str:
    """Row 25: both sides, ten seconds after it has come to rest."""
    most, ends = MU_TABLE * G * BLOCK / SPRING, []
    for beyond in (-EDGE, EDGE):
        model, data = one(f'<joint type="slide" axis="1 0 0" stiffness="{SPRING}" frictionloss="{most * SPRING}"/>', lump(BLOCK))
        data.qpos[0] = 3 * (1 + beyond) * most
        half = math.pi * math.sqrt(BLOCK / SPRING)
        mujoco.mj_step(model, data, nstep=round(1000 * (half + 10.0)))
        ends.append(1000 * (data.qpos[0] + most))
    return f"on both sides it creeps on, {ends[0]:.2f} and {ends[1]:.2f} mm in 10 s"


STATEMENTS = {23: fold, 24: door, 25: marginal}
