"""Statics at the scene's start pose: whether friction holds the mechanism at rest, and the margin of each pair."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from trunnion.basics.errors import SimulationError
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.runtime.abi import Status
from trunnion.scene.data_classes.scene import Constant, Drive, Joint, Scene
from trunnion.simulation.execution.drive_motion import positions
from trunnion.simulation.execution.failure_diagnosis import diagnose
from trunnion.simulation.execution.open_loop_report import open_loop
from trunnion.simulation.results.redundant_reactions import redundancy
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface import simulation_block as bl
from trunnion.simulation.runtime_interface.friction_pair_and_stop_names import slider_names
from trunnion.system.construction.system_builder import build
from trunnion.system.structure.bodies_and_joints import System

STILL = 1e-9
"""A freedom is at rest if its acceleration, relative to length scale · rate scale², is below this value (round-off is 1e-13)."""
EDGE = 1e-10
"""A pair counts as held if its share exceeds 1 by at most this value, the tolerance at which the runtime ends sticking."""


@dataclass(frozen=True)
class PairHold:
    """One frictional pair, held at rest.

    Attributes:
        joint: name of the joint.
        part: number of the pair in the joint.
        type: type of the joint.
        law: friction law.
        share: friction that the pair needs to stay at rest, divided by its capacity; NaN for a law without friction at rest.
        capacity: largest friction at the surface, N.
        unique: whether the share is uniquely determined.
        sticks: whether the pair stays at rest. A pair with a share above 1 still stays at rest if another pair slips first and
            thereby reduces the load of this pair.
    """

    joint: str
    part: int
    type: str
    law: str
    share: float
    capacity: float
    unique: bool
    sticks: bool

    @property
    def margin(self) -> float:
        """1 − share. A pair with a negative margin cannot hold."""
        return 1.0 - self.share


@dataclass(frozen=True)
class HoldReport:
    """The statics of a scene.

    Attributes:
        holds: whether the mechanism stays at rest.
        first: the joint that slips first; "" if all joints hold.
        margin: the smallest margin of all pairs.
        pairs: the frictional pairs.
        moves: joints without friction whose freedoms accelerate although every pair is held.
        notes: changes of the scene for this analysis, and shares that are not unique.
    """

    holds: bool
    first: str
    margin: float
    pairs: tuple[PairHold, ...]
    moves: tuple[str, ...]
    notes: tuple[str, ...]


def hold(scene: Scene) -> HoldReport:
    """Statics of the scene at its start pose, at rest, with every frictional pair held.

    Raises SimulationError if the pose cannot be assembled or if the statics have no solution.
    """
    asked, taken = hold_drives(scene)
    model = Model(asked)
    status = start_at_rest(model)[0]
    table = model.block.hold()
    if table is None:
        raise SimulationError(f"the statics of this pose cannot be solved (runtime status {status})")
    open_reactions = redundancy(model.block)
    pairs = _pairs(model.system, asked, table, open_reactions.joints, started=status == bl.OK)
    moves = accelerating_joints(model)
    shares = [p.share for p in pairs if not math.isnan(p.share)]
    worst = max(shares, default=0.0)
    over = [p for p in pairs if p.share > 1.0 + EDGE]
    first = max(over, key=lambda p: p.share).joint if over else moves[0] if moves else ""
    return HoldReport(not first, first, 1.0 - worst, pairs, moves, (*taken, *_notes(pairs)))


def hold_drives(scene: Scene) -> tuple[Scene, list[str]]:
    """(the scene with dry friction and with its drives held at their start, notes on these changes)."""
    return _hold_at_start(*_make_dry(scene))


def _make_dry(scene: Scene) -> tuple[Scene, list[str]]:
    """(the scene with dry friction in place of laws without friction at rest, notes on these changes)."""
    joints: dict[str, Joint] = dict(scene.joints)
    changed: dict[str, list[str]] = {}
    for name, j in scene.joints.items():
        dry = LAWS[scene.law_of(j.friction)].dry if j.friction is not None else ""
        if j.friction is not None and dry:
            joints[name] = replace(j, friction=replace(j.friction, law=dry))
            changed.setdefault(dry, []).append(name)
    notes = [f"statics uses dry friction (law {dry}) at {', '.join(names)}" for dry, names in changed.items()]
    return replace(scene, joints=joints) if notes else scene, notes


def _hold_at_start(scene: Scene, notes: list[str]) -> tuple[Scene, list[str]]:
    """(the scene with every drive held at its position at t = 0, ``notes`` with these changes added)."""
    joints, driven = dict(scene.joints), positions(build(scene))
    for (name, k), at in driven.items():
        drive, held = joints[name].drive, Drive(constant=Constant(rate=0.0, start=at))
        every = tuple(held if i == k else d for i, d in enumerate(drive)) if isinstance(drive, tuple) else held
        joints[name] = replace(joints[name], drive=every)
        notes.append(f"{name}: the drive is held at its start position")
    return replace(scene, joints=joints) if driven else scene, notes


def start_at_rest(model: Model) -> tuple[int, np.ndarray]:
    """Assemble the scene and begin a run at rest; returns (status, first row (columns + 1)). A status that reports a friction
    failure is a valid result here.

    Raises SimulationError if the loops cannot be closed.
    """
    settings, block = bl.Settings(rtol=1e-9), model.block
    block.configure(settings)
    code = block.assemble()
    if code != 1:
        raise SimulationError(str(open_loop(model, code)))
    block.y[model.system.nq : block.ny] = 0.0
    row = np.zeros(block.width)
    status = model.begin(settings, 0.0, 1.0, 1.0, row)
    if status == Status.FAIL_PENETRATION:
        raise SimulationError(str(diagnose(model, status)))
    return status, row


def _pairs(system: System, scene: Scene, table: np.ndarray, open_joints: tuple[str, ...], started: bool) -> tuple[PairHold, ...]:
    out = []
    for (name, part), held in zip(slider_names(system), table, strict=True):
        joint = scene.joints[name]
        assert joint.friction is not None
        law = scene.law_of(joint.friction)
        unique = not held["shared"] and name not in open_joints
        sticks = bool(started and not held["slips"])
        out.append(PairHold(name, part, joint.type, law, float(held["share"]), float(held["capacity"]), unique, sticks))
    return tuple(out)


def accelerating_joints(model: Model, still: float = STILL) -> tuple[str, ...]:
    """Tree joints with a freedom that accelerates although every pair is held. still: limit of accelerations, by default
    ``STILL``."""
    block, system, numbers = model.block, model.system, model.built.numbers
    if not block.ny:
        return ()
    rates = block.evaluate()[0][system.nq :]
    out = []
    for j in system.tree:
        units = [(1.0 if j.kind.turns(k) else numbers.length) * numbers.rate**2 for k in j.free]
        part = rates[j.v0 : j.v0 + len(j.free)]
        if any(not abs(a) <= still * u for a, u in zip(part, units, strict=True)):
            out.append(j.name)
    return tuple(out)


def _notes(pairs: tuple[PairHold, ...]) -> list[str]:
    several = list(dict.fromkeys(p.joint for p in pairs if not p.unique))
    if not several:
        return []
    chosen = "the reported one minimises the largest ratio of friction to capacity"
    return [f"the load distribution in {', '.join(several)} is not unique: {chosen}"]
