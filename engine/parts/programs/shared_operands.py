"""Operands that several programs use: friction elements, lengths of overlaps, coordinate rates."""

from __future__ import annotations

from collections.abc import Sequence

from trunnion.elements.contact.contact_element import OVERLAP, SPAN
from trunnion.elements.contact.journal import LENGTHS
from trunnion.parts.bytecode.program import Builtin, Program, Slot, Space
from trunnion.parts.primitives.primitive_cache import loop_joints_and_reactions, signals_loads_energies
from trunnion.parts.programs.body_passes import ScenePasses
from trunnion.system.structure.bodies_and_joints import FrictionElement, Joint, Signal, state_coordinates
from trunnion.system.structure.friction_joint_indices import Element
from trunnion.system.structure.parameter_table import Leaf


def element_operands(s: ScenePasses, program: Program, e: Element, *more: Leaf) -> dict[str, Slot]:
    """Operands of an element's primitives during a step: the element's numbers followed by ``more``, modes, bristle states."""
    f, system = e.friction, s.system
    modes = Slot(Space.X, system.external.mode(f.sliders[0].flag), 0)
    out = {"numbers": _numbers(s, program, f, more), "modes": modes}
    if f.bristles:
        out["b"] = Slot(Space.Y, system.nq + system.nv + system.bristles.index(e.eta[0]), 0)
    return out


def _numbers(s: ScenePasses, program: Program, f: FrictionElement, more: Sequence[Leaf]) -> Slot:
    """Parameters of an element. Parameters that depend on time or on an input are evaluated
    (``recursion.complement_equation_terms``)."""
    fixed = s.numbers([*(0.0 if isinstance(x, Signal) else x for _, x in f.numbers), *more])
    if not f.varies:
        return fixed
    out, at = program.scratch_slot(fixed.size), {name: i for i, (name, _) in enumerate(f.numbers)}
    for i, (name, x) in enumerate(f.numbers):
        own = fixed.slice(i, 1)
        if isinstance(x, Signal):
            own = program.scratch_slot(1) if name == "mu_static" else out.slice(i, 1)
            s.call(
                program,
                signals_loads_energies.at_least(),
                value=s.value(program, x, program.scratch_slot),
                least=s.zeros.slice(0, 1),
                out=own,
            )
        if name == "mu_static":
            s.call(program, signals_loads_energies.at_least(), value=own, least=out.slice(at["mu"], 1), out=out.slice(i, 1))
        elif not isinstance(x, Signal):
            program.copy(own, out.slice(i, 1))
    program.copy(fixed.slice(len(f.numbers), len(more)), out.slice(len(f.numbers), len(more)))
    return out


def lengths_of(s: ScenePasses, j: Joint) -> dict[str, Slot]:
    """Operand with the lengths of a joint's parts, if they touch along their overlap; otherwise no operand."""
    f = j.friction
    return {"lengths": s.numbers([f.number(n.name) for n in LENGTHS])} if f and j.fit.ends == OVERLAP else {}


def write_span(s: ScenePasses, program: Program, j: Joint, needs: Sequence[str], pose: Slot, out: Slot) -> None:
    """Write the span of an overlap into the reaction components, if these components include a span."""
    if SPAN in needs:
        s.call(program, signals_loads_energies.span(), pose=pose, out=out.slice(needs.index(SPAN), 1), **lengths_of(s, j))


def write_pin(s: ScenePasses, program: Program, j: Joint, needs: Sequence[str], ft: Slot, pose: Slot, out: Slot) -> None:
    """Write the components ``needs`` of f_c, m_c from the wrench on the outboard part. The span becomes 0."""
    if needs:
        pin = loop_joints_and_reactions.pin(j.kind_name, j.fit, tuple(needs))
        s.call(program, pin, ft=ft, pose=pose, out=out, **lengths_of(s, j))


def coordinate_rates(s: ScenePasses, program: Program, v: Slot, out: Slot) -> None:
    """Write q̇ of all state coordinates: a copy of the rates v, except for quaternions, which have a primitive."""
    runs: list[tuple[int, list[int]]] = []
    for j in s.system.tree:
        states, own = state_coordinates(j), v.slice(j.v0, len(j.free))
        quaternion = j.kind.quaternion
        plain = [i for i in states if quaternion < 0 or i < quaternion]
        rates = [next(k for k in range(j.kind.nv) if j.kind.coordinate_of(k) == i) for i in plain]
        if not runs or runs[-1][0] + len(runs[-1][1]) != j.q0:
            runs.append((j.q0, []))
        runs[-1][1].extend(j.v0 + j.free.index(k) for k in rates)
        if quaternion >= 0:
            at = j.q0 + states.index(quaternion)
            spin = own.slice(j.free.index(j.kind.nv - 3), 3)
            s.call(program, signals_loads_energies.quaternion(), q=Slot(Space.Y, at, 4), spin=spin, out=out.slice(at, 4))
    for at, rates in runs:
        if rates:
            program.call(Builtin.SELECT, [v, out.slice(at, len(rates))], [len(rates), *rates])
