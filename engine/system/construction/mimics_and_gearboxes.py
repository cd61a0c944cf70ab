"""Couplings of two joints' freedoms: mimics and gearboxes (theory, "Joints that follow another")."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from trunnion.elements.joints.mimic_and_light_rows import MIMIC
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.queries.numbers_by_path import unit_of
from trunnion.scene.queries.shaft_joints import shaft_joints
from trunnion.system.structure.bodies_and_joints import GROUND, Device, Fit, Joint
from trunnion.system.structure.coupling_joint_data import Mimic
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


def gearbox(scene: Scene, table: ParameterTable, joints: Sequence[Joint], name: str) -> Joint:
    """The gearbox ``name``, at the joint of its output shaft. joints: all tree joints."""
    j, at = scene.joints[name], {x.name: i for i, x in enumerate(joints)}
    leader, follower = (at[n] for n in shaft_joints(scene, j))
    inp, out = joints[leader], joints[follower]
    ratio = table.own(f"joints.{name}.ratio", j.ratio or 1.0, "1")
    return replace(
        out, name=name, kind_name=j.type, fit=Fit(), pitch=None, devices=(Device(),), friction=None, cut=True, child=GROUND,
        stiffness=None, mimic=Mimic(follower, leader, inp.inb, inp.out, True, ratio, 0.0),
    )  # fmt: skip
