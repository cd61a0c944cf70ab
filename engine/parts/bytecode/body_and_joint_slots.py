"""Slots of the bodies and joints of a scene."""

from __future__ import annotations

from collections.abc import Callable

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.parts.bytecode.program import Slot
from trunnion.system.structure.bodies_and_joints import Joint

Allocate = Callable[[int], Slot]
"""A function that returns a new slot of a given size."""


ENDS = ("gin", "gout", "gin2", "gout2")
"""Names of the constraint wrenches on the bodies of a cut joint: inboard and outboard body; four bodies of a coupling
(``Joint.ends``)."""

ALONG = {"gin": "win", "gout": "wout", "gat": "wat"}
"""Name of the wrenches caused by unit forces along the freedoms, for each name of constraint wrenches."""


def free_of(block: Slot, j: Joint) -> Slot:
    """The part of ``block`` (nv numbers) for the free rates of a tree joint."""
    return block.slice(j.v0, len(j.free))


@dataclass
class BodySlots:
    """Slots of a body and of the tree joint that carries this body.

    q, v: coordinates and rates of all freedoms. known: prescribed accelerations. motion, pose: ``MOTION`` and ``POSE`` numbers.
    work: values that the body's later functions read. force: wrench on the body. effort: forces along the freedoms. bias: w (6).
    """

    q: Slot
    v: Slot
    known: Slot
    motion: Slot
    pose: Slot
    work: Slot
    force: Slot
    effort: Slot
    bias: Slot


@dataclass
class CutJointSlots:
    """Slots of a cut joint. blocks: outputs of ``loop_joints_and_reactions.cut``, by name. effort: device forces along the freedoms
    of the joint."""

    joint: Joint
    q: Slot
    v: Slot
    pose: Slot
    blocks: dict[str, Slot]
    effort: Slot

    @property
    def ends(self) -> list[tuple[int, str]]:
        """Pairs of a body and the name of the wrenches that the constraints exert on this body."""
        return list(zip(self.joint.ends, ENDS, strict=False))

    def row(self, which: str, k: int) -> Slot:
        """The six components of wrench k in the block ``which``."""
        return self.blocks[which].slice(6 * k, 6)
