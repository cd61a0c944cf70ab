"""Programs of a kernel's smaller functions: friction laws, static friction capacity, events, energies, coordinate rates."""

from __future__ import annotations

from itertools import chain

from trunnion.parts.bytecode.body_and_joint_slots import BodySlots, CutJointSlots
from trunnion.parts.bytecode.program import Program, Slot, Space
from trunnion.parts.layout.load_operands import ends, law_numbers
from trunnion.parts.primitives.primitive_cache import force_laws, friction, joint_devices, signals_loads_energies
from trunnion.parts.programs.body_passes import ScenePasses
from trunnion.parts.programs.column_programs import ColumnPrograms
from trunnion.parts.programs.scaled_reactions import ScaledReactions
from trunnion.parts.programs.shared_operands import coordinate_rates, element_operands
from trunnion.system.structure.bodies_and_joints import Device, Joint
from trunnion.system.structure.force_curve_positions import fields_with_width, freedoms_with_curves, lines_with_curves
from trunnion.system.structure.friction_joint_indices import Element, elements
from trunnion.system.structure.loop_joints import rubbing_on_loops
from trunnion.system.structure.parameter_table import Leaf

SLIDING = 3
"""Numbers of doubles in a ``tr_sliding`` and in a ``tr_hold``."""


def write(s: ScenePasses, redundant: bool = False) -> None:
    """Write all programs of this module for a kernel. redundant: whether to write ``pressed``, too."""
    if redundant:
        _pressed(s)
    for alone in (False, True):
        _laws(s, alone)
        _held(s, alone)
    _closure(s)
    _events(s)
    _energy(s)
    coordinate_rates(s, s.program("qdot"), Slot(Space.R, 0, s.system.nv), Slot(Space.OUT, 0, s.system.nq))


def _states(s: ScenePasses, program: Program, e: Element, *more: Leaf) -> dict[str, Slot]:
    """Operands of an element: numbers, modes, bristle states. In the space R, the bristle states come after the rates."""
    operands = element_operands(s, program, e, *more)
    if e.friction.bristles:
        rates = sum(o.joint.kind.nv for o in elements(s.system))
        operands["b"] = Slot(Space.R, rates + s.system.bristles.index(e.eta[0]), 0)
    return operands


def _laws(s: ScenePasses, alone: bool) -> None:
    program, dn = s.program(f"laws{'_alone' if alone else ''}"), 0
    for e in elements(s.system):
        n, nv = len(e.needs), e.joint.kind.nv
        s.call(
            program, friction.law(s.key_of(e), alone), N=Slot(Space.N, e.n0, n), r=Slot(Space.R, e.rate0, nv),
            eta=Slot(Space.OUT, e.eta[0], nv), dN=Slot(Space.DN, dn, nv * n),
            sliding=Slot(Space.SPEED, SLIDING * e.friction.sliders[0].flag, 0), **_states(s, program, e),
        )  # fmt: skip
        dn += nv * n


def _held(s: ScenePasses, alone: bool) -> None:
    program, dn = s.program(f"held{'_alone' if alone else ''}"), 0
    for e in elements(s.system):
        n, pairs = len(e.needs), e.friction.sliders
        hold = Slot(Space.OUT, SLIDING * pairs[0].flag, SLIDING * len(pairs))
        rows = Slot(Space.DN, dn, n * len(pairs))
        dn += n * len(pairs)
        if not e.sets:
            program.zero(hold)
            if not alone:
                program.zero(rows)
            continue
        N, u = Slot(Space.N, e.n0, n), Slot(Space.U, e.eta[0], e.joint.kind.nv)
        s.call(program, friction.held(s.key_of(e), alone), N=N, u=u, hold=hold, dN=rows, **_states(s, program, e))


def _pressed(s: ScenePasses) -> None:
    """Write the change that friction causes in the scaled reactions of joints in loops."""
    program, at, dn = s.program("pressed"), 0, 0
    for e, _, count in rubbing_on_loops(s.system):
        n, nv, stiffness = len(e.needs), e.joint.kind.nv, e.joint.stiffness
        operands = _states(s, program, e, *([] if stiffness is None else [stiffness]))
        primitive, more = friction.pressed(s.key_of(e), stiffness is not None), Slot(Space.OUT, at, count)
        N, r, u = Slot(Space.N, e.n0, n), Slot(Space.R, e.rate0, nv), Slot(Space.U, e.eta[0], nv)
        s.call(program, primitive, N=N, r=r, u=u, more=more, dN=Slot(Space.DN, dn, count * (n + nv)), **operands)
        at, dn = at + count, dn + count * (n + nv)


def _closure(s: ScenePasses) -> None:
    """Write the residuals of all rows of cut joints, then the rates of these residuals."""
    program, rows = s.program("closure"), s.system.rows
    moving = s.outward(program, program.scratch_slot, forces=False)
    for c in s.closed(program, moving, program.scratch_slot, forces=False):
        n = c.joint.kind.rows
        program.copy(c.blocks["phi"], Slot(Space.OUT, c.joint.rows, n))
        program.copy(c.blocks["rate"], Slot(Space.OUT, rows + c.joint.rows, n))


def _events(s: ScenePasses) -> None:
    program = s.program("events")
    moving: list[BodySlots] = []
    closed: dict[str, CutJointSlots] = {}
    motions = any(True for _ in chain(lines_with_curves(s.system), fields_with_width(s.system)))
    if motions or s.system.unilateral or any(d.stop or d.latch or d.nonlinear for j in s.system.cuts for d in j.devices):
        moving = s.outward(program, program.scratch_slot, forces=False)
        closed = {c.joint.name: c for c in s.closed(program, moving, program.scratch_slot, forces=False)}
    for j in s.system.unilateral:
        assert j.unilateral is not None
        flag, inside, restitution = j.unilateral.flag, j.unilateral.inside, s.numbers([j.unilateral.restitution])
        phi = closed[j.name].blocks["phi"].slice(0, 1)
        s.call(program, joint_devices.depth(False), end=s.numbers([0.0]), q=phi, out=Slot(Space.OUT, flag, 1))
        program.copy(restitution, Slot(Space.OUT, s.system.stops + flag, 1))
        if inside >= 0:
            program.copy(closed[j.name].blocks["inside"], Slot(Space.OUT, inside, 1))
            program.copy(s.numbers([1.0]), Slot(Space.OUT, s.system.stops + inside, 1))
    for j in s.system.joints:
        for k, d in enumerate(j.devices):
            if d.stop is None and d.latch is None:
                continue
            _depths(s, program, d, *_freedom(s, program, closed, j, k))
    _curve_positions(s, program, moving, closed)


def _freedom(s: ScenePasses, program: Program, closed: dict[str, CutJointSlots], j: Joint, k: int) -> tuple[Slot, Slot]:
    """Coordinate and rate of freedom k of a joint. The coordinate is 0 if the freedom has no coordinate."""
    i = j.kind.coordinate_of(k)
    if j.cut:
        q, v = closed[j.name].q, closed[j.name].v
    else:
        q, v, _ = s.rates_of(program, j, program.scratch_slot)
    return q.slice(i, 1) if i >= 0 else s.zeros.slice(0, 1), v.slice(k, 1)


def _curve_positions(s: ScenePasses, program: Program, moving: list[BodySlots], closed: dict[str, CutJointSlots]) -> None:
    """Write the positions in curves and fields, after all values of the stops."""
    at = 2 * s.system.stops
    for j, k, law in freedoms_with_curves(s.system):
        q, rate = _freedom(s, program, closed, j, k)
        out, numbers = Slot(Space.OUT, at, 1), s.numbers(law.leaves)
        s.call(program, force_laws.along_freedom(law.law, "position"), numbers=numbers, q=q, rate=rate, out=out)
        at += 1
    for load, law in lines_with_curves(s.system):
        operands = ends(s, load, moving) | {"numbers": law_numbers(s, load, law)}
        s.call(program, force_laws.between_points(law.law, "position"), out=Slot(Space.OUT, at, 1), **operands)
        at += 1
    for load in fields_with_width(s.system):
        place, width = program.scratch_slot(3), s.numbers(load.numbers)
        point, motion = s.numbers(load.points[0]), moving[load.bodies[0]].motion
        s.call(program, signals_loads_energies.place(), numbers=point, motion=motion, out=place)
        for k in range(3):
            out = Slot(Space.OUT, at + k, 1)
            s.call(program, signals_loads_energies.operation("/", 1), a=place.slice(k, 1), b=width, out=out)
        at += 3


def _depths(s: ScenePasses, program: Program, d: Device, q: Slot, rate: Slot) -> None:
    """Write the depths by which stops and a latch are compressed. After all depths, write one more value for each stop and hook.
    For a stop, this is the factor of its elastic force (0 at release). For a hook, this is the excess of its signal over the
    release value."""
    for upper, bound in enumerate((d.stop.lower, d.stop.upper) if d.stop else ()):
        if bound is not None and d.stop:
            out = Slot(Space.OUT, d.stop.flags[upper], 1)
            s.call(program, joint_devices.depth(bool(upper)), end=s.numbers([bound]), q=q, out=out)
            behind = Slot(Space.OUT, s.system.stops + d.stop.flags[upper], 1)
            s.call(program, joint_devices.push(bool(upper)), damping=s.numbers([d.stop.damping]), rate=rate, out=behind)
    if d.latch is not None:
        release, found = s.value(program, d.latch.release, program.scratch_slot), program.scratch_slot(3)
        s.call(program, joint_devices.latch("depths"), q=q, release=release, out=found, **s.latch(program, d.latch))
        hook, stops = s.system.hook(d.latch.hook), s.system.stops
        for at, place in enumerate((hook, d.latch.pressed, stops + hook)):
            program.copy(found.slice(at, 1), Slot(Space.OUT, place, 1))
        program.copy(s.numbers([1.0]), Slot(Space.OUT, stops + d.latch.pressed, 1))


def _energy(s: ScenePasses) -> None:
    program = s.program("energy")
    moving = s.outward(program, program.scratch_slot, forces=False)
    closed = s.closed(program, moving, program.scratch_slot, forces=False)
    s.energies(program, moving, closed, Slot(Space.OUT, 0, 2))


def write_shares(scene: ScenePasses) -> int:
    """Write the program of the scaled reactions. Returns the number of these reactions."""
    program, shares = scene.program("kappa"), ScaledReactions(scene)
    if shares.size:
        rows = ColumnPrograms(scene, program)
        where = {j.name: rows.joint(j.name)[1] for j in shares.joints}
        transmitted = {j.name: rows.outboard_wrench(j.name) for j in shares.joints}
        shares.write(program, where, rows.moving(), lambda j: transmitted[j.name], Slot(Space.OUT, 0, shares.size))
    return shares.size


def write_contacts(scene: ScenePasses) -> int:
    """Write the program of all contact forces. Returns the number of contacts."""
    program = scene.program("contacts")
    rows, at = ColumnPrograms(scene, program), 0
    for e in (e for e in elements(scene.system) if e.contact.count):
        four = rows.watched_contacts(e.joint.name)
        program.copy(four, Slot(Space.OUT, at, four.size))
        at += four.size
    return at // 4
