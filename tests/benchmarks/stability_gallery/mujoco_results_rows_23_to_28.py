"""Results of MuJoCo at rows 23 to 28 of the gallery: a root that ends at a fold, shared loads, a marginal event, a change point."""

from __future__ import annotations

import math
from dataclasses import replace

import mujoco
import numpy as np

from tests.benchmarks.stability_gallery.mujoco_results_rows_1_to_21 import lump, one
from tests.reference.contact_and_friction.sprung_toggle_press import INERTIA, LINK, MASS, RAM
from tests.stability.entries.doors_and_marginal_stop import BLOCK, DOOR, MU_TABLE, SPACING, SPRING, G
from tests.stability.entries.doors_and_marginal_stop import REACH as OUT
from tests.stability.entries.self_tightening_brakes import ARM, GRIPS, MU, PRESS, REACH, SPIN
from tests.stability.entries.toggle_press import CHANGE
from tests.stability.entries.wishbone_and_platform import lifted, platform
from tests.stability.gallery_entry import EDGE
from trunnion.analysis.work_precision.benchmark_model import make_benchmark_model
from trunnion.analysis.work_precision.error_measure import ErrorMeasure
from trunnion.analysis.work_precision.measurement_points import FrictionVariant
from trunnion.analysis.work_precision.reference_solvers.mujoco import Mujoco
from trunnion.analysis.work_precision.reference_solvers.scene_snapshot import take_snapshot
from trunnion.analysis.work_precision.reference_solvers.solver_interface import Setting
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import simulate


def fold() -> str:
    """Row 23: the least torque at which the ball has sliding friction. The friction loss of the ball is the friction of the
    vanishing root."""
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
    """Row 24: the share of the weight's moment that the second hinge carries. The first hinge is a joint of the tree, the second
    hinge a point constraint."""
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
    """Row 25: both sides of the threshold, ten seconds after the block has come to rest."""
    most, ends = MU_TABLE * G * BLOCK / SPRING, []
    for beyond in (-EDGE, EDGE):
        model, data = one(f'<joint type="slide" axis="1 0 0" stiffness="{SPRING}" frictionloss="{most * SPRING}"/>', lump(BLOCK))
        data.qpos[0] = 3 * (1 + beyond) * most
        half = math.pi * math.sqrt(BLOCK / SPRING)
        mujoco.mj_step(model, data, nstep=round(1000 * (half + 10.0)))
        ends.append(1000 * (data.qpos[0] + most))
    return f"on both sides it continues to creep, {ends[0]:.2f} and {ends[1]:.2f} mm in 10 s"


def stepped(scene: sm.Scene, until: float, load: tuple[str, np.ndarray, np.ndarray] | None = None):
    """Step a scene without friction, as MuJoCo's reference solver writes it, by 1 ms. Returns the model and its data at the end.
    load: a body, a point on it relative to its mass centre, a force."""
    body = next(iter(scene.bodies))
    measure = ErrorMeasure(tuple(f"{body}.position[{k}]" for k in (1, 2, 3)), ((0, 1, 2),), ("m",))
    ready = make_benchmark_model(scene, FrictionVariant("", 0.0), measure, until, 1)
    peer = Mujoco(ready, take_snapshot(ready))
    model = mujoco.MjModel.from_xml_string(peer.xml(Setting("implicitfast", step=1e-3)))
    data = mujoco.MjData(model)
    for _ in range(round(1e3 * until)):
        if load:
            name, point, force = load
            i = model.body(name).id
            data.xfrc_applied[i] = [*force, *np.cross(data.xmat[i].reshape(3, 3) @ point, force)]
        mujoco.mj_step(model, data)
    return model, data


def wishbone() -> str:
    """Row 26, below the threshold."""
    scene = lifted(-EDGE)
    force = np.array([float(x) for x in scene.forces["road"].force])
    bare = replace(scene, forces={n: f for n, f in scene.forces.items() if n != "road"})
    _, data = stepped(bare, 1.0, ("knuckle", np.array([0.0, 0.0, -0.33]), force))
    turned = f"{abs(data.qpos[0]):.2g} rad after 1 s"
    return f"no friction that depends on loads; without friction the corner, which should rest, has turned by {turned}"


def stewart() -> str:
    """Row 27: the platform moves from rest. Its springs act from foot to head."""
    scene = platform(6, 0.3)
    joints, forces = dict(scene.joints), {}
    for k in range(6):
        leg = joints[f"leg{k}"]
        forces[f"leg{k}"] = sm.SpringDamper("spring_damper", (f"ground.f{k}", f"platform.h{k}"), 20000.0, 300.0, leg.start.q)
        joints[f"leg{k}"] = replace(leg, spring=None, damping=None)
    model, data = stepped(replace(scene, joints=joints, forces=forces), 0.3)
    ours = simulate(scene, until=0.3, every=0.3)["platform.position[3]"][-1]
    off = 1e3 * abs(data.xipos[model.body("platform").id][2] - ours)
    return f"no friction that depends on loads; without friction the platform is {off:.2g} mm off after 0.3 s"


def toggle() -> str:
    """Row 28: the press folded through, on its way back at 1 rad/s, at 0.01 rad before its change point. The result is taken 20 ms
    later."""
    inertia = f'mass="{MASS}" diaginertia="{INERTIA} {INERTIA} {INERTIA}"'
    link = f'<joint type="hinge" axis="0 1 0"/><inertial pos="0 0 {-LINK / 2}" {inertia}/>'
    xml = (
        f'<mujoco><option timestep="1e-3" gravity="0 0 -{G}"/><worldbody><body>{link}'
        f'<body name="lower" pos="0 0 {-LINK}">{link}</body></body>'
        f'<body name="ram" pos="0 0 {-2 * LINK}"><joint type="slide" axis="0 0 1"/>{lump(RAM)}</body></worldbody>'
        f'<equality><connect body1="lower" body2="ram" anchor="0 0 {-LINK}"/></equality></mujoco>'
    )
    model, start = mujoco.MjModel.from_xml_string(xml), CHANGE - 0.01
    data = mujoco.MjData(model)
    data.qpos[:] = start, -2 * start, 2 * LINK * (1 - math.cos(start))
    data.qvel[:] = 1.0, -2.0, 2 * LINK * math.sin(start)
    mujoco.mj_step(model, data, nstep=20)
    rows, past = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY, data.qpos[0] - CHANGE
    gap = float(np.abs(data.efc_pos[rows]).max())
    return (
        "no friction that depends on loads; without friction the press, which should jam before its change point, is "
        f"{past:.2g} rad past it after 20 ms, its loop open by {gap:.1g} m"
    )


STATEMENTS = {23: fold, 24: door, 25: marginal, 26: wishbone, 27: stewart, 28: toggle}
