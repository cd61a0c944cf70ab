"""What parts of loads between two bodies are handed."""

from __future__ import annotations

from engine.parts.blocks import Moving
from engine.parts.known import Part
from engine.parts.store import small
from engine.parts.tables import Tables
from engine.parts.tape import Block
from engine.system.structure import GROUND, Load


def joining(load: Load, what: str) -> Part:
    """The part of a load between two bodies."""
    return small.bushing(what) if load.kind == "bushing" else small.spring(what)


def ends(s: Tables, load: Load, moving: list[Moving]) -> dict[str, Block]:
    """Its numbers and the motions of its bodies."""
    motions = [s.ground if b == GROUND else moving[b].motion for b in load.bodies]
    frames = [x for frame in load.frames for x in frame]
    numbers = s.numbers([*load.numbers, *load.points[0], *load.points[1], *frames])
    return {"numbers": numbers, "a": motions[0], "b": motions[1]}
