"""Couplings of joints whose freedom follows that of another joint (theory, "Joints that follow another")."""

from __future__ import annotations

from dataclasses import replace

from trunnion.elements.joints.cam_and_curve_followers import MIMIC
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.queries.number_units import unit_of
from trunnion.system.structure.bodies_and_joints import GROUND, Joint
from trunnion.system.structure.joint_couplings import Mimic
from trunnion.system.structure.parameter_table import ParameterTable


def ties(scene: Scene, table: ParameterTable, joints: tuple[Joint, ...]) -> tuple[Joint, ...]:
    """A coupling for each joint of the scene that follows another joint. The rows of couplings come after those of cut joints.
    joints: all tree joints and cut joints."""
    at = {j.name: i for i, j in enumerate(joints) if not j.cut}
    rows, out = sum(j.kind.rows for j in joints if j.cut), list[Joint]()
    for name, j in scene.joints.items():
        if j.mimic is None:
            continue
        follower, leader = joints[at[name]], joints[at[j.mimic.joint]]
        ratio, offset = (
            table.own(f"joints.{name}.mimic.{key}", value, unit_of(scene, ("joints", name, "mimic", key)))
            for key, value in (("ratio", j.mimic.ratio), ("offset", j.mimic.offset))
        )
        tie = Mimic(at[name], at[j.mimic.joint], leader.inb, leader.out, follower.kind.turns(0), ratio, offset)
        out.append(replace(
            follower, name=f"{name}.{MIMIC.name}", kind_name=MIMIC.name, pitch=None, devices=(), friction=None, cut=True,
            child=GROUND, rows=rows + len(out), stiffness=None, mimic=tie,
        ))  # fmt: skip
    return tuple(out)
