"""What ties parts that other joints carry, on the tapes of a scene: the piece of a cam's profile, the foot on a curve, a freedom
that follows another."""

from __future__ import annotations

from typing import TYPE_CHECKING

from engine.parts.blocks import ENDS, Closed, Moving, Place
from engine.parts.known import PIECE_SIZE, Part
from engine.parts.store import closing
from engine.parts.tape import Block, Builtin, Tape
from engine.system.structure import GROUND, Joint
from engine.system.tied import FOOT, Curve, Profile

if TYPE_CHECKING:
    from engine.parts.tables import Tables

OF = ("inb", "out", "inb2", "out2")
"""Motions of the bodies of a joint that follows, and of the one that leads."""


def piece(s: Tables, tape: Tape, profile: Profile, bearing: Part, /, **places: Block) -> Block:
    """The piece of a cam's profile that is in force, by the part that finds the angle it is read at."""
    angle, out = tape.scratch_block(1), tape.scratch_block(PIECE_SIZE)
    s.call(tape, bearing, angle=angle, **places)
    kept = s.constant([*profile.starts, *(x for each in profile.pieces for x in each)])
    tape.call(Builtin.PIECE, [angle, kept, out], [len(profile.starts)])
    return out


def foot(s: Tables, tape: Tape, curve: Curve, spot: Part, /, **places: Block) -> Block:
    """The foot on a curve that is nearest to a point, by the part that finds the point in the curve's plane."""
    at, out = tape.scratch_block(2), tape.scratch_block(FOOT)
    s.call(tape, spot, angle=at, **places)
    rows = [[p.start, p.end, p.way, *p.e2, *p.e3] for p in curve.pieces]
    tape.call(Builtin.FOOT, [at, s.constant([curve.around, *(x for row in rows for x in row)]), out], [len(rows)])
    return out


def tied(s: Tables, tape: Tape, j: Joint, moving: list[Moving], place: Place) -> Closed:
    """What ties the freedoms of two tree joints."""
    assert j.mimic is not None
    both = [s.system.tree[i] for i in (j.mimic.follower, j.mimic.leader)]
    leaves = [x for one in both for x in (*one.inb_frame, *one.out_frame, *one.inb_point, *one.out_point)]
    q, v = tape.scratch_block(2), tape.scratch_block(2)
    for k, one in enumerate(both):
        tape.copy(moving[one.child].q.part(0, 1), q.part(k, 1))
        tape.copy(moving[one.child].v.part(0, 1), v.part(k, 1))
    ends = {name: moving[b].motion if b != GROUND else s.ground for name, b in zip(OF, j.ends, strict=True)}
    blocks = {"phi": place(1), "rate": place(1), "xi": place(1), **{name: place(6) for name in ENDS}}
    part = closing.tie(*(one.kind_name for one in both))
    s.call(tape, part, numbers=s.numbers([*leaves, j.mimic.ratio, j.mimic.offset]), q=q, v=v, **ends, **blocks)
    return Closed(j, s.zeros, s.zeros, s.zeros, blocks, s.zeros)
