"""A mechanism at rest: mass matrix, derivatives of the accelerations, rates that the loop constraints allow, Newton's method for a
pose of rest."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from trunnion.analysis.mechanics.linearization import state_names
from trunnion.analysis.static_bounds.equilibrium_equations import mass_matrix
from trunnion.analysis.static_bounds.kernel_function_calls import Probe
from trunnion.analysis.static_bounds.start_pose_statics import hold_drives
from trunnion.basics.errors import SimulationError
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.queries.cuttable_joints import with_cuts
from trunnion.simulation.execution.failure_diagnosis import diagnose
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface.simulation_block import Settings
from trunnion.system.construction.spanning_tree import span
from trunnion.system.structure.bodies_and_joints import state_coordinates

RANK = 1e-9
"""A singular value counts as zero below this multiple of the largest (round-off is 1e-14; real directions exceed 1e-6)."""
CLOSE = 1e-13
"""A step of Newton's method, relative to the scales at rest, counts as round-off below this value."""


def remove_friction(scene: sm.Scene) -> sm.Scene:
    """The scene without friction, with its drives held at their start. Its loops are cut at the same joints as with friction, so
    that both scenes have the same states."""
    joints, cut = {n: replace(j, friction=None, ends=None) for n, j in scene.joints.items()}, span(scene).cut
    return hold_drives(with_cuts(replace(scene, joints=joints), {n: n in cut for n in joints}))[0]


def open_contacts(scene: sm.Scene, opened: Collection[str]) -> sm.Scene:
    """The scene with the contacts of the joints ``opened`` open at the start, and all others closed."""
    joints = dict(scene.joints)
    for name, j in scene.joints.items():
        if j.unilateral is not None:
            joints[name] = replace(j, unilateral=replace(j.unilateral, starts="open" if name in opened else "touching"))
    return replace(scene, joints=joints)


class MechanismAtRest:
    """A scene at rest in its start pose, with closed loops. Raises SimulationError if the loops cannot be closed."""

    def __init__(self, scene: sm.Scene):
        self.scene, self.model = scene, Model(scene, ("energy.kinetic",))
        self.system, self.block = self.model.system, self.model.block
        self.block.configure(Settings(rtol=1e-9))
        if self.block.assemble() != 1:
            raise SimulationError("the loops cannot be closed at the start: `trunnion check` names them")
        self._begin()

    def _begin(self) -> None:
        self.block.y[self.system.nq :] = 0.0
        status = self.model.begin(Settings(rtol=1e-9), 0.0, 1.0, 1.0, np.zeros(self.block.width))
        self.block = self.model.block
        if status:
            raise SimulationError(f"the start at rest cannot be evaluated: {diagnose(self.model, status)}")
        self.block.attach_jacobian()

    def place(self, q: np.ndarray) -> None:
        """Move to the coordinates q (nq). End stops and latches then act as in this pose. Raises SimulationError if the mechanism
        cannot rest there."""
        self.block.y[: self.system.nq] = q
        self._begin()

    @property
    def freedoms(self) -> tuple[str, ...]:
        """Names of the rates of all tree joints, in the order of the state vector."""
        return state_names(self.model)[self.system.nq : self.system.nq + self.system.nv]

    def pose(self) -> np.ndarray:
        """A copy of the coordinates (nq)."""
        return self.block.y[: self.system.nq].copy()

    def open_contacts(self) -> frozenset[str]:
        """Names of the joints that only push and are open."""
        at, x = self.system.external, self.block.x
        return frozenset(j.name for j in self.system.unilateral if j.unilateral and x[at.stop(j.unilateral.flag)] < 0.5)

    def accelerations(self) -> np.ndarray:
        """Accelerations q̈ of all free rates (nv) at rest."""
        return self.block.evaluate()[0][self.system.nq : self.system.nq + self.system.nv].copy()

    def derivatives(self) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives of q̈ with respect to displacements along each rate, and with respect to the rates q̇ (nv × nv each)."""
        nq, nv = self.system.nq, self.system.nv
        D = self.block.derivatives()[:, : nq + nv]
        return D[nq : nq + nv, :nq] @ D[:nq, nq:], D[nq : nq + nv, nq:]

    def closing(self) -> np.ndarray:
        """Jacobian of the loop constraints: rates of the constraint rows per unit of each rate (rows × nv). Rows of open contacts
        are 0."""
        nv, probe = self.system.nv, Probe(self.block)
        rows = np.array([probe.rates(e)[1] for e in np.eye(nv)]).reshape(nv, -1).T
        rows[[j.rows for j in self.system.unilateral if j.name in self.open_contacts()]] = 0.0
        return rows

    def allowed(self, locked: Sequence[np.ndarray] = ()) -> np.ndarray:
        """An orthonormal basis of the rates that the loops allow (nv × freedoms). locked: further linear functions of the rates
        (rows × nv) that must be zero."""
        nv, closing = self.system.nv, self.closing()
        rows = np.vstack([closing, *locked]) if len(locked) else closing
        if not rows.size:
            return np.eye(nv)
        _, sizes, Vt = np.linalg.svd(rows)
        rank = int((sizes > RANK * sizes.max(initial=0.0)).sum())
        return Vt[rank:].T

    def reduced(self, locked: Sequence[np.ndarray] = ()) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(K, C, basis (nv × freedoms)) of the equation s̈ = K s + C ṡ, where s are the freedoms that the loops allow."""
        basis, M = self.allowed(locked), self.mass()
        K, C = self.derivatives()
        if not basis.size:
            return np.zeros((0, 0)), np.zeros((0, 0)), basis
        inertia = basis.T @ M @ basis
        return np.linalg.solve(inertia, basis.T @ M @ K @ basis), np.linalg.solve(inertia, basis.T @ M @ C @ basis), basis

    def mass(self) -> np.ndarray:
        """The mass matrix (nv × nv)."""
        return mass_matrix(Probe(self.block), self.system.nv)

    def move(self, way: np.ndarray) -> None:
        """Move the coordinates along the rates ``way`` (nv) for 1 s, then normalise the quaternions."""
        nq, y = self.system.nq, self.block.y
        T = self.block.derivatives()[:nq, nq : nq + self.system.nv]
        y[:nq] += T @ way
        for j in self.system.tree:
            if j.kind.quaternion >= 0:
                at = j.q0 + state_coordinates(j).index(j.kind.quaternion)
                y[at : at + 4] /= np.linalg.norm(y[at : at + 4])

    def settle(self, rounds: int = 40) -> bool:
        """Find a pose without accelerations and with closed loops by Newton's method, with the contacts that are closed now.
        Returns whether the method converged to a pose in which the closed contacts press, and the open ones have gaps."""
        numbers, nq = self.model.built.numbers, self.system.nq
        scale = numbers.rate**2
        last = np.inf
        for _ in range(rounds):
            a, (gap, _) = self.accelerations(), self.block.gap()
            K, _ = self.derivatives()
            rows, right = np.vstack([K / scale, self.closing()]), -np.concatenate([a / scale, gap])
            way = np.linalg.lstsq(rows, right, rcond=RANK)[0]
            size = float(np.abs(way).max(initial=0.0))
            if not np.isfinite(size) or size > 1e3:
                return False
            self.move(way)
            if size < CLOSE or (size < 1e-9 and size >= 0.5 * last):
                try:
                    self._begin()
                except SimulationError:
                    if not self.system.unilateral:
                        raise
                    return False  # the start fails because the parts of an open contact penetrate each other
                return bool(np.abs(self.accelerations()).max(initial=0.0) < 1e-9 * max(scale, 1e-300)) or nq == 0
            last = size
        return False
