"""Blocks of the bodies and joints of a scene in a pass."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from engine.parts.tape import Block
from engine.system.structure import Joint

Place = Callable[[int], Block]
"""Where a pass puts so many numbers."""


ENDS = ("gin", "gout", "gin2", "gout2")
"""Wrenches of rows on the inboard and outboard body of a cut joint, and of a joint it follows (``Joint.ends``)."""

ALONG = {"gin": "win", "gout": "wout", "gat": "wat"}
"""Wrenches of forces along its freedoms there."""


@dataclass
class Moving:
    """Blocks of a body in a pass: coordinates and rates of its joint (all), accelerations of what is prescribed, its motion, the
    joint's pose, what the part keeps; what acts on it and along its joint's freedoms."""

    q: Block
    v: Block
    known: Block
    motion: Block
    pose: Block
    work: Block
    force: Block
    effort: Block
    bias: Block


@dataclass
class Closed:
    """Blocks of a cut joint in a pass (``closing.cut``): coordinates, rates, accelerations' bias, pose, wrenches; and the forces of
    its devices along its freedoms."""

    joint: Joint
    q: Block
    v: Block
    pose: Block
    blocks: dict[str, Block]
    effort: Block

    @property
    def ends(self) -> list[tuple[int, str]]:
        """The bodies that its rows are on, and what these wrenches are called."""
        return list(zip(self.joint.ends, ENDS, strict=False))

    def row(self, which: str, k: int) -> Block:
        """Wrench k (6) of those called ``which``."""
        return self.blocks[which].part(6 * k, 6)
