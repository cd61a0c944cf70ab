"""Powers (``kernel.units.power_expressions``) as calls of primitives."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from trunnion.kernel.interface.runtime_tables import GIVING
from trunnion.parts.bytecode.body_and_joint_slots import BodySlots
from trunnion.parts.bytecode.program import Builtin, Program, Slot, Space
from trunnion.parts.layout.load_operands import call_joining
from trunnion.parts.primitives.primitive_cache import signals_loads_energies
from trunnion.parts.programs.body_passes import ScenePasses
from trunnion.system.structure.bodies_and_joints import Joint


def write_powers(
    s: ScenePasses, program: Program, motion_of: Callable[[Joint], tuple[Slot, Slot]], moving: list[BodySlots],
    N: Sequence[Slot], space: Space, at: int = 0,
) -> None:  # fmt: skip
    """Write powers, W: friction of each joint, dampers, drives, loads. motion_of: returns the coordinates and rates of a joint. N:
    reaction on each body, for drives."""
    system = s.system
    count = len(system.frictional) + 1 + GIVING
    each = [Slot(space, at + i, 1) for i in range(count)]
    for out in each:
        program.zero(out)
    for j, out in zip(system.frictional, each, strict=False):
        program.call(Builtin.ADD_DOT, [s.eta(j), motion_of(j)[1], out], [j.kind.nv, -1])
    damping, drive, loads = each[-3:]
    for j in system.joints:
        for k, d, q, rate in s.each_device(j, *motion_of(j)):
            s.device(program, d, "power", q, rate, damping)
            if d.effort:
                program.call(Builtin.ADD_DOT, [s.value(program, d.effort, program.scratch_slot), rate, loads], [1, 1])
            if d.motor:
                effort = program.scratch_slot(1)
                program.zero(effort)
                s.motor(program, d, rate, effort)
                program.call(Builtin.ADD_DOT, [effort, rate, loads], [1, 1])
            if d.drive:
                effort = program.scratch_slot(1)
                s.drive_effort(program, j, k, moving[j.child], N[j.child], effort)
                program.call(Builtin.ADD_DOT, [effort, rate, drive], [1, 1])
    for load in system.loads:
        if load.joins:
            call_joining(s, program, load, "power", moving, out=damping)
        else:
            operands = s.applied(program, load, moving[load.bodies[0]], program.scratch_slot)
            out = damping if load.dissipates else loads
            s.call(program, signals_loads_energies.load(load.acts_as, load.body_frame, "power"), out=out, **operands)
