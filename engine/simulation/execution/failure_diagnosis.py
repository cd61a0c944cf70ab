"""Diagnosis of failed runs: the reason and the joint."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from trunnion.elements.contact.contact_element import OVERLAP
from trunnion.elements.contact.journal import LENGTHS
from trunnion.runtime.abi import Status, Why
from trunnion.simulation.execution.missing_inertia import VANISHING, inertia_outcome
from trunnion.simulation.execution.runnable_model import Model
from trunnion.simulation.results.outcome import DEAD_CENTRE, OVERLAP_LOST, Outcome, from_status
from trunnion.simulation.runtime_interface.friction_pair_and_stop_names import slider_names
from trunnion.system.structure.bodies_and_joints import Joint, System, way_to_ground
from trunnion.system.structure.parameter_table import Param

LOOPS = (Status.FAIL_CLOSURE, Status.FAIL_GIMBAL)
"""Values of ``Status`` for loops that cannot be kept closed."""
FRICTION = (Status.FAIL_MULTIPLIERS, Status.FAIL_MODES)
"""Values of ``Status`` for complement equations without a root, or without a consistent set of modes."""
WHY: dict[int, str] = {Why.JAM: "jammed", Why.INCONSISTENT: "inconsistent"}


def diagnose(model: Model, status: int) -> Outcome:
    """The named outcome of a failed run. After a failure of friction, the runtime stops the slip of the responsible friction pair.
    If the pair then sticks, the joint has jammed."""
    block = model.block
    if separated := _separated_joint(model):
        return Outcome.named(OVERLAP_LOST, block.time, separated)
    if status in FRICTION and model.system.cuts and not model.system.frictional:
        return _dead_centre(model)
    if status in FRICTION:
        why, pair = block.why()
        if why == Why.UNDECIDED:
            return Outcome.named("undecided", block.time, "")
        if why in WHY:
            name, part = slider_names(model.system)[pair]
            z = block.multipliers()
            numbers = {"part": part, "friction": float(np.abs(z).max()) if z.size else 0.0}
            return Outcome.named(WHY[why], block.time, name, numbers)
    if status == Status.FAIL_PENETRATION:
        return _penetration(model, from_status(status, block.time, ""))
    if status in LOOPS:
        return _loop_outcome(model, from_status(status, block.time, ""))
    if status == Status.FAIL_STEP and (lost := inertia_outcome(model, VANISHING)):
        return lost
    return from_status(status, block.time, suspect(model, status))


def _separated_joint(model: Model) -> str:
    """The joint whose parts overlap by less than a millionth of the shorter part's length; "" if there is no such joint."""
    values = model.built.parameters.values
    for j in model.system.frictional:
        if j.fit.ends != OVERLAP or j.cut or 0 in j.driven:
            continue
        assert j.friction is not None
        both = [values[x.index] if isinstance(x, Param) else x for x in (j.friction.number(s.name) for s in LENGTHS)]
        if 0.5 * sum(both) - abs(float(model.block.y[j.q0])) <= 1e-6 * min(both):
            return j.name
    return ""


def _dead_centre(model: Model) -> Outcome:
    """The outcome of a mechanism without friction whose loop equations have no solution. The outcome names the first driven
    loop."""
    loops = {cut.name: loop_joints(model.system, cut) for cut in model.system.cuts}
    cut = next((c for c in model.system.cuts if any(j.driven for j in loops[c.name])), model.system.cuts[0])
    plain = Outcome.named(DEAD_CENTRE, model.block.time, next((j.name for j in loops[cut.name] if j.driven), cut.name))
    return replace(plain, advice=plain.advice + describe_loop(model.system, cut))


def _loop_outcome(model: Model, plain: Outcome) -> Outcome:
    """The outcome ``plain`` with further names: the responsible joint, all joints of its loop, and the driven joints."""
    row, independence = model.block.open_row()
    cut = next((j for j in model.system.cuts if j.rows <= row < j.rows + j.kind.rows), None)
    if cut is None:
        return plain
    joint, advice = loop_joint(model.system, cut, plain.name == "gimbal_lock"), plain.advice + describe_loop(model.system, cut)
    return replace(plain, joint=joint.name, advice=advice, numbers={"independence": independence} if independence >= 0.0 else {})


def _penetration(model: Model, plain: Outcome) -> Outcome:
    """The outcome ``plain`` with the joint of the contact and the depth of penetration."""
    row, depth = model.block.open_row()
    joint = next(j.name for j in model.system.unilateral if j.rows == row)
    return replace(plain, joint=joint, advice=f"{plain.advice}; the depth is {depth:.6g} m", numbers={"depth": depth})


def loop_joint(system: System, cut: Joint, gimbal: bool) -> Joint:
    """The joint that the outcome of a failed loop names: the cut joint, or, in gimbal lock, a joint of the loop
    with two crossed rotation axes."""
    return next((j for j in loop_joints(system, cut) if j.kind.second_axis >= 0), cut) if gimbal else cut


def describe_loop(system: System, cut: Joint) -> str:
    """Text about the loop of a cut joint, to append to advice: "; the loop is a, b, c; driven: a"."""
    driving = [j.name for j in system.joints if j.driven]
    driven = f"; driven: {', '.join(driving)}" if driving else ""
    return f"; the loop is {', '.join(j.name for j in loop_joints(system, cut))}{driven}"


def loop_joints(system: System, cut: Joint) -> list[Joint]:
    """The joints of the loop that a cut joint closes. These are the tree joints between the two parts of the cut joint, from
    inboard to outboard, then the cut joint. For a coupling, these are the leader and the follower."""
    if cut.mimic:
        return [system.tree[cut.mimic.leader], system.tree[cut.mimic.follower]]
    ways = [[system.tree[body] for body in way_to_ground(system.bodies, end)] for end in (cut.inb, cut.out)]
    first, second = ([j for j in a if j not in b] for a, b in (ways, ways[::-1]))
    return [*first, *second[::-1], cut]


def suspect(model: Model, status: int) -> str:
    """Name of the joint that probably causes a failure; "" if unknown.

    If the equations of friction have no solution, this is the joint with the largest friction in the last row. If numbers are not
    finite, this is the fastest joint; at rest, the first joint with a freedom."""
    system = model.system
    if status == Status.FAIL_MULTIPLIERS and system.frictional:
        z = model.block.multipliers()
        sizes = [max(abs(z[e]) for e in j.friction.eta) for j in system.frictional if j.friction]
        return system.frictional[int(np.argmax(sizes))].name
    if status == Status.FAIL_NOT_FINITE:
        return _fastest(model)
    return ""


def _fastest(model: Model) -> str:
    """Name of the tree joint with the largest rate, in rad/s or length scales per second."""
    system, length = model.system, model.built.numbers.length
    rates = np.abs(model.block.y[system.nq : system.nq + system.nv])
    best, name = -1.0, ""
    for j in system.tree:
        for i, k in enumerate(j.free):
            rate = rates[j.v0 + i] * (1.0 if j.kind.turns(k) else 1.0 / length)
            if rate > best:
                best, name = rate, j.name
    return name
