"""Primitives of loads between two bodies, and the operands of these primitives."""

from __future__ import annotations

from trunnion.parts.bytecode.body_and_joint_slots import BodySlots
from trunnion.parts.bytecode.program import Slot
from trunnion.parts.layout.scene_tables import SceneTables
from trunnion.parts.primitives.primitive_cache import loads_and_scalars
from trunnion.parts.primitives.primitive_keys import Primitive
from trunnion.system.structure.bodies_and_joints import GROUND, Load


def joining(load: Load, what: str) -> Primitive:
    """The primitive of a load between two bodies. what: "wrench", "power" or "potential"."""
    return loads_and_scalars.bushing(what) if load.kind == "bushing" else loads_and_scalars.spring(what)


def ends(s: SceneTables, load: Load, moving: list[BodySlots]) -> dict[str, Slot]:
    """Operands of the primitive: numbers of the load, and motions of its two bodies."""
    motions = [s.ground if b == GROUND else moving[b].motion for b in load.bodies]
    return {"numbers": s.numbers(load.leaves), "a": motions[0], "b": motions[1]}
