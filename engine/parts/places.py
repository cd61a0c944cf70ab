"""Places that several tapes hand to parts: of an element, of the rates of coordinates."""

from __future__ import annotations

from collections.abc import Sequence

from engine.contact.base import OVERLAP, SPAN
from engine.contact.journal import LENGTHS
from engine.parts.scene import Scene
from engine.parts.store import small
from engine.parts.tape import Block, Builtin, Space, Tape
from engine.system.elements import Element
from engine.system.leaves import Leaf
from engine.system.structure import FrictionElement, Joint, Signal, state_coordinates


def element_places(s: Scene, tape: Tape, e: Element, *more: Leaf) -> dict[str, Block]:
    """Numbers (and ``more``), modes and (of a law with bristles) states of an element, as its parts are handed them while
    stepping."""
    f, system = e.friction, s.system
    modes = Block(Space.X, system.external.mode(f.sliders[0].flag), 0)
    out = {"numbers": _numbers(s, tape, f, more), "modes": modes}
    if f.bristles:
        out["b"] = Block(Space.Y, system.nq + system.nv + system.bristles.index(e.eta[0]), 0)
    return out


def _numbers(s: Scene, tape: Tape, f: FrictionElement, more: Sequence[Leaf]) -> Block:
    """Numbers of an element behind each other; those that follow time or an input as they are now (``recursion.elements``)."""
    fixed = s.numbers([*(0.0 if isinstance(x, Signal) else x for _, x in f.numbers), *more])
    if not f.varies:
        return fixed
    out, at = tape.scratch_block(fixed.size), {name: i for i, (name, _) in enumerate(f.numbers)}
    for i, (name, x) in enumerate(f.numbers):
        own = fixed.part(i, 1)
        if isinstance(x, Signal):
            own = tape.scratch_block(1) if name == "mu_static" else out.part(i, 1)
            s.call(tape, small.at_least(), value=s.value(tape, x, tape.scratch_block), least=s.zeros.part(0, 1), out=own)
        if name == "mu_static":
            s.call(tape, small.at_least(), value=own, least=out.part(at["mu"], 1), out=out.part(i, 1))
        elif not isinstance(x, Signal):
            tape.copy(own, out.part(i, 1))
    tape.copy(fixed.part(len(f.numbers), len(more)), out.part(len(f.numbers), len(more)))
    return out


def lengths_of(s: Scene, j: Joint) -> dict[str, Block]:
    """Lengths of the parts of a joint that touch where they overlap, for parts that are handed them."""
    f = j.friction
    return {"lengths": s.numbers([f.number(n.name) for n in LENGTHS])} if f and j.fit.ends == OVERLAP else {}


def write_span(s: Scene, tape: Tape, j: Joint, needs: Sequence[str], pose: Block, out: Block) -> None:
    """Put the span of what overlaps among reaction components that are whole (not one multiplier's)."""
    if SPAN in needs:
        s.call(tape, small.span(), pose=pose, out=out.part(needs.index(SPAN), 1), **lengths_of(s, j))


def coordinate_rates(s: Scene, tape: Tape, v: Block, out: Block) -> None:
    """q̇ of all coordinates that are states: those that are rates, then those of quaternions."""
    runs: list[tuple[int, list[int]]] = []
    for j in s.system.tree:
        states, own = state_coordinates(j), v.part(j.v0, len(j.free))
        quaternion = j.kind.quaternion
        plain = [i for i in states if quaternion < 0 or i < quaternion]
        rates = [next(k for k in range(j.kind.nv) if j.kind.coordinate_of(k) == i) for i in plain]
        if not runs or runs[-1][0] + len(runs[-1][1]) != j.q0:
            runs.append((j.q0, []))
        runs[-1][1].extend(j.v0 + j.free.index(k) for k in rates)
        if quaternion >= 0:
            at = j.q0 + states.index(quaternion)
            spin = own.part(j.free.index(j.kind.nv - 3), 3)
            s.call(tape, small.quaternion(), q=Block(Space.Y, at, 4), spin=spin, out=out.part(at, 4))
    for at, rates in runs:
        if rates:
            tape.call(Builtin.PICK, [v, out.part(at, len(rates))], [len(rates), *rates])
