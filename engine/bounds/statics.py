"""Equilibrium at rest as numbers: which reactions, frictions and efforts of drives balance the loads, and what they press.

Unknown are x = [λ; η; efforts of drives]: multipliers of the loops' rows, of friction, and what holds each drive in its place. All
bodies are in equilibrium when q̈ = 0, one equation for each freedom of the tree, multiplied by the mass matrix so that it is one
of forces: E x + E_p p + e = 0, p the loads (METHOD, "Bounds at rest").
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from engine.basics.problems import Problem, SceneError
from engine.bounds.freed import Load, freed, pose_columns
from engine.bounds.probe import Probe
from engine.contact.base import SPAN
from engine.contact.registry import pairs_at_rest
from engine.contact.resting import Pair, Rubs
from engine.scene.model import Scene
from engine.scene.touching import touching
from engine.simulation.hold import resting, started
from engine.simulation.run import Model
from engine.system.build import Built, build
from engine.system.elements import Element, elements
from engine.system.leaves import Param
from engine.system.structure import System


@dataclass(frozen=True)
class Rubbing:
    """A joint with friction: its element and its numbers."""

    element: Element
    rubs: Rubs

    @property
    def reactions(self) -> slice:
        """Its components among the reactions."""
        return slice(self.element.n0, self.element.n0 + len(self.element.needs))


@dataclass(frozen=True)
class Statics:
    """Equilibrium of a scene at its start. x (n) = [λ (a); η (e); efforts of drives (m)], p (l): its other loads, at their amounts
    ``now``; balance E (nv × n), by_load E_p (nv × l), constant e (nv), N and N m; reactions N = N_x x + N_p p + N_0 (nn);
    rates: of the freedoms that rub (nr × nv); closure (rows × nv); driven (m × nv): which rates the drives hold; length, m, and
    force, N: scales."""

    system: System
    joints: tuple[Rubbing, ...]
    drives: tuple[Load, ...]
    loads: tuple[Load, ...]
    multipliers: int
    balance: np.ndarray
    by_load: np.ndarray
    constant: np.ndarray
    reaction: np.ndarray
    reaction_by_load: np.ndarray
    reaction_constant: np.ndarray
    rates: np.ndarray
    closure: np.ndarray
    driven: np.ndarray
    length: float
    force: float
    probe: Probe
    notes: tuple[str, ...]

    def joint(self, name: str) -> Rubbing:
        """A joint with friction by its name."""
        return next(j for j in self.joints if j.rubs.joint == name)

    def pairs(self) -> list[Pair]:
        """Every pair that can hold something, in the engine's order."""
        return [p for j in self.joints if j.element.sets for p in pairs_at_rest(j.rubs)]

    @property
    def now(self) -> np.ndarray:
        """Amounts of the loads at the start (l)."""
        return np.array([load.now for load in self.loads])

    @property
    def eta0(self) -> int:
        """Where η begins in x."""
        return self.multipliers - self.system.neta


TINY = 1e-12
"""The least unit of force by which differences are taken, N: of a scene without mass or size."""


def statics(scene: Scene) -> Statics:
    """The equilibrium of a scene at its start pose, all rates zero. SimulationError where the pose cannot be assembled."""
    asked, notes = resting(scene)
    _refuse_teeth(asked)
    built = build(asked)
    made, every = freed(asked, built, _poses(asked, built))
    model = Model(made, ())
    model._load(redundant=True)
    started(model)
    drives, loads = tuple(p for p in every if p.drive), tuple(p for p in every if not p.drive)
    return _numbers(model, drives, loads, tuple(notes))


def _refuse_teeth(scene: Scene) -> None:
    """SceneError for joints whose contacts press otherwise than by sums of norms."""
    found = [n for n, j in scene.joints.items() if j.friction is not None and (e := touching(j)) is not None and e.bound]
    what, hint = "what holds is not found where teeth push wheels apart", "leave its friction out to ask: then it is an ideal gear"
    if found:
        raise SceneError([Problem(f"joints.{n}.friction", what, hint) for n in found])


def _poses(scene: Scene, built: Built) -> dict[str, tuple[float, ...]]:
    """Coordinates of joints with drives, where the scene starts once its loops are closed."""
    names = pose_columns(built)
    if not names:
        return {}
    row = started(Model(scene, names))[1]
    found = dict(zip(names, row[1:].tolist(), strict=True))
    joints = dict.fromkeys(n.rsplit(".q[", 1)[0] for n in names)
    return {j: tuple(v for n, v in found.items() if n.rsplit(".q[", 1)[0] == j) for j in joints}


def _numbers(model: Model, drives: tuple[Load, ...], loads: tuple[Load, ...], notes: tuple[str, ...]) -> Statics:
    """Everything by evaluation: a value, and a difference for each unknown and each load."""
    probe, built, system = Probe(model.block), model.built, model.system
    n, nv = probe.unknowns, probe.sizes["nv"]
    unit = max(built.numbers.energy / built.numbers.length, TINY)
    mass = mass_matrix(probe, nv)
    zero = np.zeros(n)
    a0, r0 = probe.accelerations(zero), probe.reactions(zero)
    E = np.zeros((nv, n + len(drives)))
    R = np.zeros((len(r0), n + len(drives)))
    for k in range(n):
        z = zero.copy()
        z[k] = unit
        E[:, k], R[:, k] = (probe.accelerations(z) - a0) / unit, (probe.reactions(z) - r0) / unit
    by = [_by_load(probe, built, load, a0, r0, unit) for load in (*drives, *loads)]
    for k in range(len(drives)):
        E[:, n + k], R[:, n + k] = by[k]
    Ep = np.array([a for a, _ in by[len(drives) :]]).reshape(len(loads), nv).T
    Rp = np.array([r for _, r in by[len(drives) :]]).reshape(len(loads), len(r0)).T
    now = np.array([load.now for load in loads])
    still = np.eye(nv)
    moved = [probe.rates(v) for v in still]
    rates = np.array([r for r, _ in moved]).reshape(nv, -1).T
    closure = np.array([c for _, c in moved]).reshape(nv, -1).T
    return Statics(
        system, _joints(model, r0),
        drives, loads, n, mass @ E, mass @ Ep, mass @ (a0 - Ep @ now), R, Rp, r0 - Rp @ now, rates, closure,
        _driven(system, drives, nv), built.numbers.length, unit, probe, notes,
    )  # fmt: skip


def mass_matrix(probe: Probe, nv: int) -> np.ndarray:
    """The mass matrix from the kinetic energy; the identity where the kernel does not know that (large trees: their equations are
    then those of accelerations, which are the same)."""
    unit = np.eye(nv)
    each = [probe.kinetic(v) for v in unit]
    if not all(each):
        return unit
    out = np.diag(2.0 * np.array(each))
    for i in range(nv):
        for k in range(i):
            out[i, k] = out[k, i] = probe.kinetic(unit[i] + unit[k]) - each[i] - each[k]
    return out


def _by_load(probe: Probe, built: Built, load: Load, a0: np.ndarray, r0: np.ndarray, unit: float) -> tuple[np.ndarray, np.ndarray]:
    """What a unit of a load changes: (accelerations, reaction components)."""
    changed, zero = probe.parameters.copy(), np.zeros(probe.unknowns)
    for path, share in load.paths:
        changed[built.parameters.paths.index(path)] += unit * share
    probe.prepare(changed)
    found = (probe.accelerations(zero) - a0) / unit, (probe.reactions(zero) - r0) / unit
    probe.prepare(probe.parameters)
    return found


def _joints(model: Model, reactions: np.ndarray) -> tuple[Rubbing, ...]:
    """Joints with friction; what overlaps does so as at the reactions' pose."""
    values = model.built.parameters.values
    out = []
    for e in elements(model.system):
        leaves = [(name, e.friction.number(name)) for name, _ in e.friction.numbers]  # nothing follows time any more
        sizes = {name: float(values[leaf.index] if isinstance(leaf, Param) else leaf) for name, leaf in leaves}
        if SPAN in e.needs:
            sizes["half_length"] = float(reactions[e.n0 + e.needs.index(SPAN)])
        sense = float(e.joint.fit.sign)
        out.append(Rubbing(e, Rubs(e.joint.name, e.friction.contact, e.needs, tuple(e.eta), sizes, sense, e.friction.adams)))
    return tuple(out)


def _driven(system: System, drives: tuple[Load, ...], nv: int) -> np.ndarray:
    out = np.zeros((len(drives), nv))
    joints = {j.name: j for j in system.tree}
    for row, load in enumerate(drives):
        assert load.drive is not None
        out[row, joints[load.drive[0]].v0 + load.drive[1]] = 1.0
    return out
