"""Notes about followers without friction whose force becomes a pull, with the first instant (theory, "Cams")."""

from __future__ import annotations

import numpy as np

from trunnion.simulation.runtime_interface.simulation_block import Block
from trunnion.system.structure.bodies_and_joints import Joint, System

ONE_SIDED = ("point", "face")
"""Values of ``JointKind.follows`` for followers that push in the direction of the normal. For a point on a curve, the side to which
it pushes at the start counts as the pushing side."""


class FollowerPulls:
    """Records when the normal force of a follower without friction (of a cam or curve) first becomes a pull during a run. system:
    structure of the block; the block must have started."""

    def __init__(self, system: System, block: Block):
        watched = [j for j in system.cuts if j.kind.follows in (*ONE_SIDED, "curve") and not (j.friction or j.unilateral)]
        slots = {row: i for i, row in enumerate(block.kernel.facts["active_rows"])} if watched else {}
        self.joints: list[Joint] = [j for j in watched if j.rows in slots]
        self.block = block
        if not self.joints:
            return
        self.slots = np.array([slots[j.rows] for j in self.joints], np.intc)
        start = block.active_multipliers()[self.slots]
        signs = np.where(start < 0.0, -1.0, 1.0)
        self.sense = np.where([j.kind.follows == "curve" for j in self.joints], signs, 1.0)
        pushes = self.sense * start
        self.values = np.array([pushes, pushes, np.where(pushes < 0.0, block.time, np.nan)])
        pointers = (x.ctypes.data for x in (self.slots, self.sense, self.values))
        block.lib.tr_watch_pulls(block.at, len(self.joints), *pointers)

    def notes(self) -> list[str]:
        """A note for every follower that pulled. Afterwards the runtime no longer records the forces."""
        if not self.joints:
            return []
        self.block.lib.tr_watch_pulls(self.block.at, 0, None, None, None)
        return [_note(j, t) for j, t in zip(self.joints, self.values[2], strict=True) if not np.isnan(t)]


def _note(j: Joint, time: float) -> str:
    if j.kind.follows == "curve":
        return f"{j.name}: at t = {time:.10g} s the force changes sides; a curve that guides on one side only would lose the point"
    return f"{j.name}: from t = {time:.10g} s the cam pulls; a follower without a groove would lift off there"
