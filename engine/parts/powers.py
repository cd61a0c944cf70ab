"""Powers beside the derivative (``kernel.powers``), as calls of parts."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from engine.kernel.records import GIVING
from engine.parts.blocks import Moving
from engine.parts.joining import ends, joining
from engine.parts.scene import Scene
from engine.parts.store import small
from engine.parts.tape import Block, Builtin, Space, Tape
from engine.system.structure import Joint


def write_powers(
    s: Scene, tape: Tape, motion_of: Callable[[Joint], tuple[Block, Block]], moving: list[Moving], N: Sequence[Block], space: Space,
    at: int = 0,
) -> None:  # fmt: skip
    """Powers of friction of each joint, dampers, drives and loads, W. motion_of: coordinates and rates of a joint; N: of each
    body, where motions are driven."""
    system = s.system
    count = len(system.frictional) + 1 + GIVING
    each = [Block(space, at + i, 1) for i in range(count)]
    for out in each:
        tape.zero(out)
    for j, out in zip(system.frictional, each, strict=False):
        tape.call(Builtin.PRODUCT, [s.eta(j), motion_of(j)[1], out], [j.kind.nv, -1])
    damping, drive, loads = each[-3:]
    for j in system.joints:
        for k, d, q, rate in s.each_device(j, *motion_of(j)):
            s.device(tape, d, "power", q, rate, damping)
            if d.effort:
                tape.call(Builtin.PRODUCT, [s.value(tape, d.effort, tape.scratch_block), rate, loads], [1, 1])
            if d.motor:
                effort = tape.scratch_block(1)
                tape.zero(effort)
                s.motor(tape, d, rate, effort)
                tape.call(Builtin.PRODUCT, [effort, rate, loads], [1, 1])
            if d.drive:
                effort = tape.scratch_block(1)
                s.drive_effort(tape, j, k, moving[j.child], N[j.child], effort)
                tape.call(Builtin.PRODUCT, [effort, rate, drive], [1, 1])
    for load in system.loads:
        if load.joins:
            s.call(tape, joining(load, "power"), out=damping, **ends(s, load, moving))
        else:
            places = s.applied(tape, load, moving[load.bodies[0]], tape.scratch_block)
            s.call(tape, small.load(load.kind, load.body_frame, "power"), out=loads, **places)
