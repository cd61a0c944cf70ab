"""Tapes of the functions of a kernel beside its stages: laws, what pairs at rest hold, stops, energies, rates of coordinates."""

from __future__ import annotations

from engine.parts.known import rubbing
from engine.parts.places import coordinate_rates, element_places
from engine.parts.rows import Rows
from engine.parts.scene import Scene
from engine.parts.shares import Shares
from engine.parts.store import devices, friction
from engine.parts.tape import Block, Space, Tape
from engine.system.elements import Element, elements
from engine.system.leaves import Leaf
from engine.system.loops import rubbing_on_loops
from engine.system.structure import Device, state_coordinates

SLIDING = 3
"""Numbers of a ``tr_sliding`` and of a ``tr_hold``."""


def write(s: Scene, redundant: bool = False) -> None:
    """All of them; redundant: the one that only the redundant variant has too."""
    if redundant:
        _pressed(s)
    for alone in (False, True):
        _laws(s, alone)
        _held(s, alone)
    _closure(s)
    _events(s)
    _energy(s)
    coordinate_rates(s, s.tape("qdot"), Block(Space.R, 0, s.system.nv), Block(Space.OUT, 0, s.system.nq))


def _states(s: Scene, tape: Tape, e: Element, *more: Leaf) -> dict[str, Block]:
    """Numbers, modes and states of an element, the latter behind the rates."""
    places = element_places(s, tape, e, *more)
    if e.friction.bristles:
        rates = sum(o.joint.kind.nv for o in elements(s.system))
        places["b"] = Block(Space.R, rates + s.system.bristles.index(e.eta[0]), 0)
    return places


def _laws(s: Scene, alone: bool) -> None:
    tape, dn = s.tape(f"laws{'_alone' if alone else ''}"), 0
    for e in elements(s.system):
        n, nv = len(e.needs), e.joint.kind.nv
        s.call(
            tape, friction.law(rubbing(e), alone), N=Block(Space.N, e.n0, n), r=Block(Space.R, e.rate0, nv),
            eta=Block(Space.OUT, e.eta[0], nv), dN=Block(Space.DN, dn, nv * n),
            sliding=Block(Space.SPEED, SLIDING * e.friction.sliders[0].flag, 0), **_states(s, tape, e),
        )  # fmt: skip
        dn += nv * n


def _held(s: Scene, alone: bool) -> None:
    tape, dn = s.tape(f"held{'_alone' if alone else ''}"), 0
    for e in elements(s.system):
        n, pairs = len(e.needs), e.friction.sliders
        hold = Block(Space.OUT, SLIDING * pairs[0].flag, SLIDING * len(pairs))
        rows = Block(Space.DN, dn, n * len(pairs))
        dn += n * len(pairs)
        if not e.sets:
            tape.zero(hold)
            if not alone:
                tape.zero(rows)
            continue
        N, u = Block(Space.N, e.n0, n), Block(Space.U, e.eta[0], e.joint.kind.nv)
        s.call(tape, friction.held(rubbing(e), alone), N=N, u=u, hold=hold, dN=rows, **_states(s, tape, e))


def _pressed(s: Scene) -> None:
    """What friction changes in the scaled reactions of joints on loops that rub."""
    tape, at, dn = s.tape("pressed"), 0, 0
    for e, _, count in rubbing_on_loops(s.system):
        n, nv, stiffness = len(e.needs), e.joint.kind.nv, e.joint.stiffness
        places = _states(s, tape, e, *([] if stiffness is None else [stiffness]))
        part, more = friction.pressed(rubbing(e), stiffness is not None), Block(Space.OUT, at, count)
        N, r, dN = Block(Space.N, e.n0, n), Block(Space.R, e.rate0, nv), Block(Space.DN, dn, count * n)
        s.call(tape, part, N=N, r=r, more=more, dN=dN, **places)
        at, dn = at + count, dn + count * n


def _closure(s: Scene) -> None:
    """Residuals of all rows of cut joints, then their rates."""
    tape, rows = s.tape("closure"), s.system.rows
    moving = s.outward(tape, tape.scratch_block, forces=False)
    for c in s.closed(tape, moving, tape.scratch_block, forces=False):
        n = c.joint.kind.rows
        tape.copy(c.blocks["phi"], Block(Space.OUT, c.joint.rows, n))
        tape.copy(c.blocks["rate"], Block(Space.OUT, rows + c.joint.rows, n))


def _events(s: Scene) -> None:
    tape = s.tape("events")
    closed = {}
    if any(d.stop or d.latch for j in s.system.cuts for d in j.devices):
        moving = s.outward(tape, tape.scratch_block, forces=False)
        closed = {c.joint.name: c for c in s.closed(tape, moving, tape.scratch_block, forces=False)}
    for j in s.system.joints:
        for k, d in enumerate(j.devices):
            if d.stop is None and d.latch is None:
                continue
            i = j.kind.coordinate_of(k)
            if j.cut:
                q, rate = closed[j.name].q.part(i, 1), closed[j.name].v.part(k, 1)
            elif j.driven:
                both = s.rates_of(tape, j, tape.scratch_block)
                q, rate = both[0].part(i, 1), both[1].part(k, 1)
            else:
                q = Block(Space.Y, j.q0 + state_coordinates(j).index(i), 1)
                rate = Block(Space.Y, s.system.nq + j.v0 + k, 1)
            _depths(s, tape, d, q, rate)


def _depths(s: Scene, tape: Tape, d: Device, q: Block, rate: Block) -> None:
    """How deep the stops and the latch of a freedom are pressed; behind, how far stops are from letting go (of a latch: 1)."""
    for upper, bound in enumerate((d.stop.lower, d.stop.upper) if d.stop else ()):
        if bound is not None and d.stop:
            out = Block(Space.OUT, d.stop.flags[upper], 1)
            s.call(tape, devices.depth(bool(upper)), end=s.numbers([bound]), q=q, out=out)
            behind = Block(Space.OUT, s.system.stops + d.stop.flags[upper], 1)
            s.call(tape, devices.push(bool(upper)), damping=s.numbers([d.stop.damping]), rate=rate, out=behind)
    if d.latch is not None:
        release, both = s.value(tape, d.latch.release, tape.scratch_block), tape.scratch_block(2)
        s.call(tape, devices.latch("depths"), q=q, release=release, out=both, **s.latch(tape, d.latch))
        for at, flag in enumerate((s.system.hook(d.latch.hook), d.latch.pressed)):
            tape.copy(both.part(at, 1), Block(Space.OUT, flag, 1))
            tape.copy(s.numbers([1.0]), Block(Space.OUT, s.system.stops + flag, 1))


def _energy(s: Scene) -> None:
    tape = s.tape("energy")
    moving = s.outward(tape, tape.scratch_block, forces=False)
    closed = s.closed(tape, moving, tape.scratch_block, forces=False)
    s.energies(tape, moving, closed, Block(Space.OUT, 0, 2))


def write_shares(scene: Scene) -> int:
    """The tape of the scaled reactions; how many there are."""
    tape, shares = scene.tape("kappa"), Shares(scene)
    if shares.size:
        rows = Rows(scene, tape)
        where = {j.name: rows.joint(j.name)[1] for j in shares.joints}
        transmitted = {j.name: rows.on_outboard(j) for j in shares.joints}
        shares.write(tape, where, rows.moving(), lambda j: transmitted[j.name], Block(Space.OUT, 0, shares.size))
    return shares.size


def write_contacts(scene: Scene) -> int:
    """The tape of all contacts' forces; how many there are."""
    tape = scene.tape("contacts")
    rows, at = Rows(scene, tape), 0
    for e in (e for e in elements(scene.system) if e.contact.count):
        four = rows.touching(e)[1]
        tape.copy(four, Block(Space.OUT, at, four.size))
        at += four.size
    return at // 4
