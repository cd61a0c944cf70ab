"""The designer's static question: at the scene's start pose, at rest, does it hold, where, and with what margin?"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from engine.basics.problems import SimulationError
from engine.friction import REGISTRY as LAWS
from engine.scene.model import Constant, Drive, Joint, Scene
from engine.simulation import block as bl
from engine.simulation.gaps import open_loop
from engine.simulation.motions import positions
from engine.simulation.pairs import slider_names
from engine.simulation.redundancy import redundancy
from engine.simulation.run import Model
from engine.system.build import build
from engine.system.structure import System

STILL = 1e-9
"""A freedom without friction holds when its acceleration is below this, of length scale · rate scale² (round-off is 1e-13)."""
EDGE = 1e-10
"""How far beyond its capacity a pair may be asked to hold: the tolerance at which sticking is released."""


@dataclass(frozen=True)
class PairHold:
    """One frictional pair, held at rest. share: the friction it needs, over the most it can give there (NaN: its law holds
    nothing at rest); capacity: that most, N at the surface; margin: 1 − share; unique: whether no other share is possible;
    sticks: whether the pair stays at rest (it may although its share is too large, when another pair slips first and relieves
    it)."""

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
        """1 − share; below 0 the pair cannot hold."""
        return 1.0 - self.share


@dataclass(frozen=True)
class HoldReport:
    """The answer for a scene. holds: nothing moves; first: the joint that lets go first ("" when all hold); margin: the
    smallest margin of any pair; moves: joints without friction at rest whose freedoms accelerate although every pair is held."""

    holds: bool
    first: str
    margin: float
    pairs: tuple[PairHold, ...]
    moves: tuple[str, ...]
    notes: tuple[str, ...]


def hold(scene: Scene) -> HoldReport:
    """Statics of the scene at its start pose with all rates zero, every frictional pair held. SimulationError when the pose cannot
    be assembled or the statics have no answer."""
    asked, taken = resting(scene)
    model = Model(asked)
    status = started(model)[0]
    table = model.block.hold()
    if table is None:
        raise SimulationError(f"the statics of this pose cannot be solved (runtime status {status})")
    open_reactions = redundancy(model.block)
    pairs = _pairs(model.system, asked, table, open_reactions.joints, started=status == bl.OK)
    moves = _moving(model)
    shares = [p.share for p in pairs if not math.isnan(p.share)]
    worst = max(shares, default=0.0)
    over = [p for p in pairs if p.share > 1.0 + EDGE]
    first = max(over, key=lambda p: p.share).joint if over else moves[0] if moves else ""
    return HoldReport(not first, first, 1.0 - worst, pairs, moves, (*taken, *_words(pairs)))


def resting(scene: Scene) -> tuple[Scene, list[str]]:
    """The scene of which statics is asked, dry and with its drives held where they start, and notes of what was changed."""
    return _stopped(*_dry(scene))


def _dry(scene: Scene) -> tuple[Scene, list[str]]:
    """The scene with dry friction wherever its law has none at rest, and notes of what was changed."""
    joints: dict[str, Joint] = dict(scene.joints)
    changed: dict[str, list[str]] = {}
    for name, j in scene.joints.items():
        dry = LAWS[scene.law_of(j.friction)].dry if j.friction is not None else ""
        if j.friction is not None and dry:
            joints[name] = replace(j, friction=replace(j.friction, law=dry))
            changed.setdefault(dry, []).append(name)
    notes = [f"asked of dry friction (law {dry}): {', '.join(names)}" for dry, names in changed.items()]
    return replace(scene, joints=joints), notes


def _stopped(scene: Scene, notes: list[str]) -> tuple[Scene, list[str]]:
    """The scene with every drive held where a run has it at t = 0, and notes of what was changed."""
    joints = dict(scene.joints)
    for (name, k), at in positions(build(scene)).items():
        drive, held = joints[name].drive, Drive(constant=Constant(rate=0.0, start=at))
        every = tuple(held if i == k else d for i, d in enumerate(drive)) if isinstance(drive, tuple) else held
        joints[name] = replace(joints[name], drive=every)
        notes.append(f"{name}: its drive is held where it starts")
    return replace(scene, joints=joints), notes


def started(model: Model) -> tuple[int, np.ndarray]:
    """Assemble, set all rates to zero and begin a run: the runtime's status (here a failure of friction is an answer) and the first
    row."""
    settings, block = bl.Settings(rtol=1e-9), model.block
    block.configure(settings)
    code = block.assemble()
    if code != 1:
        raise SimulationError(str(open_loop(model, code)))
    block.y[model.system.nq : block.ny] = 0.0
    row = np.zeros(block.width)
    return model.begin(settings, 0.0, 1.0, 1.0, row), row


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


def _moving(model: Model) -> tuple[str, ...]:
    """Tree joints with a freedom that accelerates although every pair is held."""
    block, system, numbers = model.block, model.system, model.built.numbers
    if not block.ny:
        return ()
    rates = block.evaluate()[0][system.nq :]
    out = []
    for j in system.tree:
        units = [(1.0 if j.kind.turns(k) else numbers.length) * numbers.rate**2 for k in j.free]
        part = rates[j.v0 : j.v0 + len(j.free)]
        if any(not abs(a) <= STILL * u for a, u in zip(part, units, strict=True)):
            out.append(j.name)
    return tuple(out)


def _words(pairs: tuple[PairHold, ...]) -> list[str]:
    several = list(dict.fromkeys(p.joint for p in pairs if not p.unique))
    if not several:
        return []
    return [
        f"how {', '.join(several)} share the load is not unique: it is spread so that the largest share is as small as it can be"
    ]
