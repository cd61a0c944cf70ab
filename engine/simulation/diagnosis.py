"""Why a run cannot go on, and which joint it is about."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from engine.abi import Status, Why
from engine.contact.base import OVERLAP
from engine.contact.journal import LENGTHS
from engine.simulation.outcome import APART, Outcome, from_status
from engine.simulation.pairs import slider_names
from engine.system.leaves import Param
from engine.system.structure import Joint, System

if TYPE_CHECKING:
    from engine.simulation.run import Model

LOOPS = (Status.FAIL_CLOSURE, Status.FAIL_GIMBAL)
"""Statuses in which a loop cannot go on."""
FRICTION = (Status.FAIL_MULTIPLIERS, Status.FAIL_MODES)
"""Statuses in which friction has no answer: no root, no consistent set of modes."""
WHY: dict[int, str] = {Why.JAM: "jammed", Why.INCONSISTENT: "inconsistent"}


def diagnose(model: Model, status: int) -> Outcome:
    """The named outcome of a failed run. A failure of friction brings the pair to blame to rest; if that pair then sticks, its
    joint has jammed."""
    block = model.block
    if apart := _apart(model):
        return Outcome.named(APART, block.time, apart)
    if status in FRICTION:
        why, pair = block.why()
        if why == Why.UNDECIDED:
            return Outcome.named("undecided", block.time, "")
        if why in WHY:
            name, part = slider_names(model.system)[pair]
            z = block.multipliers()
            numbers = {"part": part, "friction": float(np.abs(z).max()) if z.size else 0.0}
            return Outcome.named(WHY[why], block.time, name, numbers)
    if status in LOOPS:
        return _stuck_loop(model, from_status(status, block.time, ""))
    return from_status(status, block.time, suspect(model, status))


def _apart(model: Model) -> str:
    """The joint whose parts no longer overlap, or overlap by less than a millionth of the shorter; "" where there is none."""
    values = model.built.parameters.values
    for j in model.system.frictional:
        if j.fit.ends != OVERLAP or j.cut or 0 in j.driven:
            continue
        assert j.friction is not None
        both = [values[x.index] if isinstance(x, Param) else x for x in (j.friction.number(s.name) for s in LENGTHS)]
        if 0.5 * sum(both) - abs(float(model.block.y[j.q0])) <= 1e-6 * min(both):
            return j.name
    return ""


def _stuck_loop(model: Model, plain: Outcome) -> Outcome:
    """The outcome of a loop that cannot go on: it names the cut joint (or one with two crossed axes), all joints of the loop,
    and what drives it."""
    row, independence = model.block.open_row()
    cut = next((j for j in model.system.cuts if j.rows <= row < j.rows + j.kind.rows), None)
    if cut is None:
        return plain
    joint, advice = loop_joint(model.system, cut, plain.name == "gimbal"), plain.advice + loop_words(model.system, cut)
    return replace(plain, joint=joint.name, advice=advice, numbers={"independence": independence} if independence >= 0.0 else {})


def loop_joint(system: System, cut: Joint, gimbal: bool) -> Joint:
    """The joint that is named where the loop of a cut joint cannot go on: itself; for a gimbal one with two crossed axes."""
    return next((j for j in around(system, cut) if j.kind.second_axis >= 0), cut) if gimbal else cut


def loop_words(system: System, cut: Joint) -> str:
    """What the advice says beside of a loop: "; the loop is a, b, c; driven: a"."""
    driving = [j.name for j in system.joints if j.driven]
    driven = f"; driven: {', '.join(driving)}" if driving else ""
    return f"; the loop is {', '.join(j.name for j in around(system, cut))}{driven}"


def around(system: System, cut: Joint) -> list[Joint]:
    """The joints of the loop a cut joint closes, from its inboard part through the tree to its outboard part, then itself."""
    if cut.mimic:
        return [system.tree[cut.mimic.leader], system.tree[cut.mimic.follower]]
    ways = []
    for body in (cut.inb, cut.out):
        way = []
        while body >= 0:
            way.append(system.tree[body])
            body = system.bodies[body].parent
        ways.append(way)
    first, second = ([j for j in a if j not in b] for a, b in (ways, ways[::-1]))
    return [*first, *second[::-1], cut]


def suspect(model: Model, status: int) -> str:
    """Name of the joint a failure is probably about. Complement equations without a solution: the joint whose friction would
    have to grow without bound (largest multiplier ratio when friction is scaled up). Numbers that are not finite: the joint
    that moves fastest where they were still finite; at rest the first joint with a freedom."""
    system = model.system
    if status == Status.FAIL_MULTIPLIERS and system.frictional:
        names = [j.name for j in system.frictional]
        return names[0] if len(names) == 1 else _largest(model, names)
    if status == Status.FAIL_NOT_FINITE:
        return _fastest(model)
    return ""


def _fastest(model: Model) -> str:
    """The tree joint with the largest rate, in the units of the error control."""
    system, length = model.system, model.built.numbers.length
    rates = np.abs(model.block.y[system.nq : system.nq + system.nv])
    best, name = -1.0, ""
    for j in system.tree:
        for i, k in enumerate(j.free):
            rate = rates[j.v0 + i] * (1.0 if j.kind.turns(k) else 1.0 / length)
            if rate > best:
                best, name = rate, j.name
    return name


def _largest(model: Model, names: list[str]) -> str:
    """The frictional joint with the largest friction in the last row that was written."""
    sizes = []
    z = model.block.multipliers()
    for name in names:
        j = next(j for j in model.system.frictional if j.name == name)
        assert j.friction is not None
        sizes.append(max(abs(z[e]) for e in j.friction.eta))
    return names[int(np.argmax(sizes))]
