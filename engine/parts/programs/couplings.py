"""Slots of joints that couple parts carried by other joints: active piece of a cam's profile, foot on a curve, freedom that follows
another freedom."""

from __future__ import annotations

from typing import TYPE_CHECKING

from trunnion.parts.bytecode.body_and_joint_slots import ENDS, Allocate, BodySlots, CutJointSlots
from trunnion.parts.bytecode.program import Builtin, Program, Slot
from trunnion.parts.primitives.primitive_cache import loop_joints_and_reactions
from trunnion.parts.primitives.primitive_keys import PIECE_SIZE, POSE, Primitive
from trunnion.system.structure.bodies_and_joints import GROUND, Joint
from trunnion.system.structure.coupling_joint_data import FOOT, Curve, Profile

if TYPE_CHECKING:
    from trunnion.parts.layout.scene_tables import SceneTables

GEARED = {"gat": 6, "bias": 1, "win": 6, "wout": 6, "wat": 6, "pose": POSE, "point": 3}
"""Sizes of the outputs that only the coupling of a gearbox has."""
OF = ("inb", "out", "inb2", "out2")
"""Names of operands: motions of the inboard and outboard body of the follower's joint, then of the leader's joint."""


def piece(s: SceneTables, program: Program, profile: Profile, bearing: Primitive, /, **operands: Slot) -> Slot:
    """The active piece of a cam's profile. bearing: primitive of the angle at which the profile is evaluated."""
    angle, out = program.scratch_slot(1), program.scratch_slot(PIECE_SIZE)
    s.call(program, bearing, angle=angle, **operands)
    kept = s.constant([*profile.starts, *(x for each in profile.pieces for x in each)])
    program.call(Builtin.CURVE_PIECE, [angle, kept, out], [len(profile.starts)])
    return out


def foot(s: SceneTables, program: Program, curve: Curve, spot: Primitive, /, **operands: Slot) -> Slot:
    """The foot of a point on a curve. spot: primitive of the point in the curve's plane."""
    at, out = program.scratch_slot(2), program.scratch_slot(FOOT)
    s.call(program, spot, angle=at, **operands)
    rows = [[p.start, p.end, p.way, *p.e2, *p.e3] for p in curve.pieces]
    program.call(Builtin.CURVE_FOOT, [at, s.constant([curve.around, *(x for row in rows for x in row)]), out], [len(rows)])
    return out


def light(s: SceneTables, j: Joint) -> CutJointSlots:
    """The slots for the row of a light freedom, whose force acts along the freedom."""
    blocks = dict.fromkeys(("phi", "rate", "xi"), s.zeros.slice(0, 1)) | dict.fromkeys(ENDS[:2], s.zeros)
    return CutJointSlots(j, s.zeros, s.zeros, s.zeros, blocks, s.zeros)


def tied(s: SceneTables, program: Program, j: Joint, moving: list[BodySlots], allocate: Allocate) -> CutJointSlots:
    """The slots of a coupling between freedoms of two tree joints."""
    assert j.mimic is not None
    both = [s.system.tree[i] for i in (j.mimic.follower, j.mimic.leader)]
    leaves = [x for one in both for x in (*one.inb_frame, *one.out_frame, *one.inb_point, *one.out_point)]
    q, v = program.scratch_slot(2), program.scratch_slot(2)
    for k, one in enumerate(both):
        program.copy(moving[one.child].q.slice(0, 1), q.slice(k, 1))
        program.copy(moving[one.child].v.slice(0, 1), v.slice(k, 1))
    ends = {name: moving[b].motion if b != GROUND else s.ground for name, b in zip(OF, j.ends, strict=True)}
    names = {**dict.fromkeys(("phi", "rate", "xi"), 1), **dict.fromkeys(ENDS, 6), **(GEARED if j.kind.nv else {})}
    blocks = {name: allocate(size) for name, size in names.items()}
    primitive = loop_joints_and_reactions.tie(*(one.kind_name for one in both), j.kind_name)
    s.call(program, primitive, numbers=s.numbers([*leaves, j.mimic.ratio, j.mimic.offset]), q=q, v=v, **ends, **blocks)
    return CutJointSlots(j, s.zeros, moving[both[0].child].v.slice(0, 1), blocks.get("pose", s.zeros), blocks, s.zeros)
