"""Equilibrium at rest as linear equations in reactions, frictions, drive efforts and loads (theory, "Bounds at rest").

The unknowns are x = [λ; η; efforts of drives]. λ are the multipliers of the loop constraints, η the multipliers of friction. The
efforts of drives hold the driven freedoms. Equilibrium means q̈ = 0, one equation for each freedom of the tree. Multiplication by
the mass matrix gives the force equations E x + E_p p + e = 0, where p are the loads.
"""

from __future__ import annotations

import numpy as np

from trunnion.analysis.static_bounds.kernel_function_calls import Probe
from trunnion.analysis.static_bounds.loads_as_parameters import Load, pose_columns, release_drives
from trunnion.analysis.static_bounds.start_pose_statics import hold_drives, start_at_rest
from trunnion.basics.errors import Problem, SceneError
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.contact.contact_element import SPAN
from trunnion.elements.contact.registry import pairs_at_rest
from trunnion.elements.contact.static_friction_capacity import Pair, Rubs
from trunnion.scene.checks.variable_friction_and_input_curves import BY_LOAD
from trunnion.scene.data_classes.scene import ByLoad, Scene
from trunnion.simulation.run import Model
from trunnion.system.construction.system_builder import Built, build
from trunnion.system.structure.bodies_and_joints import System
from trunnion.system.structure.friction_joint_indices import Element, elements
from trunnion.system.structure.parameter_table import Param


@dataclass(frozen=True)
class FrictionJoint:
    """A joint with friction. element: its friction element; rubs: the numerical data of its contact."""

    element: Element
    rubs: Rubs

    @property
    def reactions(self) -> slice:
        """Slice of the element's components in the vector of reactions."""
        return slice(self.element.n0, self.element.n0 + len(self.element.needs))


@dataclass(frozen=True)
class Statics:
    """Equilibrium of a scene at its start.

    The unknowns are x (n) = [λ (a); η (e); efforts of drives (m)], and the loads are p (l).

    Attributes:
        joints: the joints with friction.
        drives: the m efforts of drives.
        loads: the l loads.
        multipliers: number of multipliers, a + e.
        balance: E (nv × n) of the force equations E x + E_p p + e = 0, N and N m.
        by_load: E_p (nv × l).
        constant: e (nv).
        reaction: N_x (nn × n) of the reactions N = N_x x + N_p p + N_0.
        reaction_by_load: N_p (nn × l).
        reaction_constant: N_0 (nn).
        rates: Jacobian of the rates of freedoms with friction by the rates of the tree (nr × nv).
        closure: Jacobian of the loop constraints by the rates of the tree (rows × nv).
        driven: selection of the rates that the drives hold (m × nv).
        length: scale of lengths, m.
        force: scale of forces, N.
    """

    system: System
    joints: tuple[FrictionJoint, ...]
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

    def joint(self, name: str) -> FrictionJoint:
        """The joint with friction that has this name."""
        return next(j for j in self.joints if j.rubs.joint == name)

    def pairs(self) -> list[Pair]:
        """Every pair with a capacity at rest, in the runtime's order."""
        return [p for j in self.joints if j.element.sets for p in pairs_at_rest(j.rubs)]

    @property
    def now(self) -> np.ndarray:
        """Amounts of the loads at the start (l)."""
        return np.array([load.now for load in self.loads])

    @property
    def eta0(self) -> int:
        """Index of the first entry of η in x."""
        return self.multipliers - self.system.neta


TINY = 1e-12
"""Least force step of the finite differences, N, for scenes without mass or size."""


def statics(scene: Scene) -> Statics:
    """The equilibrium of a scene at its start pose, at rest. Raises SimulationError if the pose cannot be assembled."""
    asked, notes = hold_drives(scene)
    _refuse_efficiency_tables(asked)
    built = build(asked)
    made, every = release_drives(asked, built, _poses(asked, built))
    model = Model(made, ())
    model._load(redundant=True)
    start_at_rest(model)
    drives, loads = tuple(p for p in every if p.drive), tuple(p for p in every if not p.drive)
    return _evaluate_maps(model, drives, loads, tuple(notes))


def _refuse_efficiency_tables(scene: Scene) -> None:
    """Raise SceneError for tables of efficiencies: their capacities are not sums of norms."""
    tables = [(n, k) for n, j in scene.joints.items() for k in BY_LOAD if isinstance(getattr(j.friction, k, None), ByLoad)]
    what = "bounds at rest refuse a table of efficiencies: the static capacity is then a curve over the load, not a sum of norms"
    hint = "give the efficiency at the load as one number"
    if tables:
        raise SceneError([Problem(f"joints.{n}.friction.{k}", what, hint) for n, k in tables])


def _poses(scene: Scene, built: Built) -> dict[str, tuple[float, ...]]:
    """Start coordinates of the joints that have drives, rad or m, after assembly."""
    names = pose_columns(built)
    if not names:
        return {}
    row = start_at_rest(Model(scene, names))[1]
    found = dict(zip(names, row[1:].tolist(), strict=True))
    joints = dict.fromkeys(n.rsplit(".q[", 1)[0] for n in names)
    return {j: tuple(v for n, v in found.items() if n.rsplit(".q[", 1)[0] == j) for j in joints}


def _evaluate_maps(model: Model, drives: tuple[Load, ...], loads: tuple[Load, ...], notes: tuple[str, ...]) -> Statics:
    """The equations, from evaluations of the kernel: one value at zero, and one finite difference for each unknown and each
    load."""
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
    by = [_load_effect(probe, built, load, a0, r0, unit) for load in (*drives, *loads)]
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
    """The mass matrix (nv × nv), computed from the kinetic energy. If the kernel (of a large tree) has no kinetic energy, the
    result is the identity.

    With the identity, the equations balance accelerations instead of forces; their solutions are the same.
    """
    unit = np.eye(nv)
    each = [probe.kinetic(v) for v in unit]
    if not all(each):
        return unit
    out = np.diag(2.0 * np.array(each))
    for i in range(nv):
        for k in range(i):
            out[i, k] = out[k, i] = probe.kinetic(unit[i] + unit[k]) - each[i] - each[k]
    return out


def _load_effect(
    probe: Probe, built: Built, load: Load, a0: np.ndarray, r0: np.ndarray, unit: float
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Derivatives of the accelerations and of the reaction components by a load."""
    changed, zero = probe.parameters.copy(), np.zeros(probe.unknowns)
    for path, share in load.paths:
        changed[built.parameters.paths.index(path)] += unit * share
    probe.prepare(changed)
    found = (probe.accelerations(zero) - a0) / unit, (probe.reactions(zero) - r0) / unit
    probe.prepare(probe.parameters)
    return found


def _joints(model: Model, reactions: np.ndarray) -> tuple[FrictionJoint, ...]:
    """The joints with friction. An overlap that varies with sliding has its length at the start pose."""
    values = model.built.parameters.values
    out = []
    for e in elements(model.system):
        leaves = [(name, e.friction.number(name)) for name, _ in e.friction.numbers]
        sizes = {name: float(values[leaf.index] if isinstance(leaf, Param) else leaf) for name, leaf in leaves}
        if SPAN in e.needs:
            sizes["half_length"] = float(reactions[e.n0 + e.needs.index(SPAN)])
        sense = float(e.joint.fit.sign)
        out.append(FrictionJoint(e, Rubs(e.joint.name, e.friction.contact, e.needs, tuple(e.eta), sizes, sense, e.friction.adams)))
    return tuple(out)


def _driven(system: System, drives: tuple[Load, ...], nv: int) -> np.ndarray:
    out = np.zeros((len(drives), nv))
    joints = {j.name: j for j in system.tree}
    for row, load in enumerate(drives):
        assert load.drive is not None
        out[row, joints[load.drive[0]].v0 + load.drive[1]] = 1.0
    return out
