"""Primitives of loads between two bodies, and the operands of these primitives."""

from __future__ import annotations

from trunnion.parts.bytecode.body_and_joint_slots import BodySlots
from trunnion.parts.bytecode.program import Program, Slot
from trunnion.parts.layout.scene_tables import SceneTables
from trunnion.parts.primitives.primitive_cache import force_laws, signals_loads_energies
from trunnion.parts.primitives.primitive_keys import Primitive
from trunnion.scene.force_laws.registry import REGISTRY as FORCE_LAWS
from trunnion.system.structure.bodies_and_joints import GROUND, LawForce, Load


def joining(load: Load, what: str) -> Primitive:
    """The primitive of a load between two bodies. what: "wrench", "power" or "potential"."""
    return signals_loads_energies.bushing(what) if load.kind == "bushing" else signals_loads_energies.spring(what)


def ends(s: SceneTables, load: Load, moving: list[BodySlots]) -> dict[str, Slot]:
    """Operands of the primitive: numbers of the load, and motions of its two bodies."""
    motions = [s.ground if b == GROUND else moving[b].motion for b in load.bodies]
    return {"numbers": s.numbers(load.leaves), "a": motions[0], "b": motions[1]}


def call_joining(s: SceneTables, program: Program, load: Load, what: str, moving: list[BodySlots], **outputs: Slot) -> None:
    """Add the wrench, power or potential energy of a load between two bodies to the outputs."""
    operands = ends(s, load, moving)
    s.call(program, joining(load, what), **outputs, **operands)
    for law in load.nonlinear:
        if acts(law, what):
            own = operands | {"numbers": law_numbers(s, load, law)}
            s.call(program, force_laws.between_points(law.law, what), **outputs, **own)


def acts(law: LawForce, what: str) -> bool:
    """Whether a law has this quantity: springs have a potential energy, dampers a power."""
    return what not in ("power", "potential") or (what == "potential") == FORCE_LAWS[law.law].elastic


def law_numbers(s: SceneTables, load: Load, law: LawForce) -> Slot:
    """Numbers of a law along the line between two points, and the points."""
    return s.numbers([*law.leaves, *(x for point in load.points for x in point)])
