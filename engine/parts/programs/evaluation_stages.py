"""Programs of stage 1 (maps of the multipliers) and of stage 2 (accelerations for known multipliers)."""

from __future__ import annotations

from collections.abc import Sequence

from trunnion.parts.bytecode.program import Builtin, Program, Slot, Space
from trunnion.parts.primitives.primitive_cache import friction
from trunnion.parts.programs.body_passes import ScenePasses
from trunnion.parts.programs.evaluation_passes import EvaluationPasses
from trunnion.parts.programs.mechanical_powers import write_powers
from trunnion.parts.programs.multiplier_map_columns import ForceColumns
from trunnion.parts.programs.multiplier_map_columns_sparse import SparseForceColumns
from trunnion.parts.programs.shared_operands import coordinate_rates, element_operands
from trunnion.system.structure.friction_joint_indices import Element


class EvaluationPrograms(EvaluationPasses):
    """Writes stage 1 and stage 2."""

    def __init__(self, scene: ScenePasses, active: Sequence[int] = (), redundant: bool = False):
        super().__init__(scene, active, redundant)
        first, second = scene.program("stage1"), scene.program("stage2")
        if self.maps.columns:
            if self.asked:
                self._known(first)
            self._columns(first)
        self._derivative(second if self.maps.columns else first)

    def _columns(self, program: Program) -> None:
        """Write the columns of all multipliers. If few loops share bodies, a column extends over the path of its loop only."""
        if self.maps.matrix:
            self.apart: SparseForceColumns | None = SparseForceColumns(self, program)
            return
        self.apart, self.columns = None, self.kept_slot(self.system.nv * self.maps.columns)
        ForceColumns(self, program, self.columns)

    # -- maps ---------------------------------------------------------------------------------------------------------------

    def _known(self, program: Program) -> None:
        """Write the rates, and those parts of N and Q that do not depend on multipliers."""
        bodies = range(len(self.system.bodies))
        qdd, Z, N = self.accelerate(program, self.y, self.F, "accelerations", bodies, self.scene.base)
        m = self.maps
        self.write_rates(program)
        for e in self.elements:
            j, nv, own = e.joint, e.joint.kind.nv, m.N(-1).slice(e.n0, len(e.needs))
            held = m.Q(-1).slice(e.eta[0], nv) if m.held else self.scene.zeros
            if j.cut:
                self._known_of_cut(program, e, Z, own, held)
                continue
            self.pin(program, e, N[j.child], own)
            for k in range(nv if m.held else 0):
                program.copy(self.scene.freedom_acceleration(j, k, self.moving[j.child], qdd), held.slice(k, 1))
        if self.shares:
            ft = {j.name: self.transmitted(program, j, N) for j in self.shares.joints}
            self.shares.write(program, self.where(), self.moving, lambda j: ft[j.name], m.kappa(-1))

    def _known_of_cut(self, program: Program, e: Element, Z: list[Slot], out: Slot, held: Slot) -> None:
        """Write the reaction components that the devices of a cut joint cause, and the accelerations of the joint's freedoms."""
        j, c = e.joint, self.closing(e.joint)
        self.pin_of_cut(program, e, self.transmitted(program, j, []), out)
        if self.maps.held:
            program.copy(c.blocks["bias"], held)
            self.along_cut(program, c, [self.scene.acceleration(Z, b) for b in (j.inb, j.out)], held)

    # -- accelerations ------------------------------------------------------------------------------------------------------

    def _derivative(self, program: Program) -> None:
        system, s = self.system, self.scene
        nq, nv = system.nq, system.nv
        coordinate_rates(s, program, Slot(Space.Y, nq, nv), Slot(Space.DY, 0, nq))
        y, count = self.y, self.maps.columns
        if count:
            y = program.scratch_slot(nv)
        if count and self.apart:
            program.copy(self.y, y)
            self.apart.add(program, y)
        elif count:
            program.call(Builtin.COMBINE, [self.y, self.columns, Slot(Space.Z, 0, count), y], [nv, count, nv])
        every = range(len(system.bodies))
        qdd, Z, _ = self.accelerate(program, y, [s.zeros for _ in every], "onward", every, s.base)
        self.write_derivative(program, qdd, Z)

    def write_derivative(self, program: Program, qdd: Slot, Z: list[Slot]) -> None:
        """Write the powers, and the entries of ẏ after the coordinate rates. Both are computed from the accelerations."""
        system, s = self.system, self.scene
        nq, nv, nb = system.nq, system.nv, len(system.bristles)
        program.copy(qdd, Slot(Space.DY, nq, nv))
        rows = {row: i for i, row in enumerate(self.active)}
        N = s.balance(program, self.moving, Z, self.closed, rows) if nb or any(j.driven for j in system.tree) else []
        at = nq + nv
        for e in self.elements:
            if e.friction.bristles:
                self._drift(program, e, N, Slot(Space.DY, at, e.joint.kind.nv))
                at += e.joint.kind.nv
        write_powers(self.scene, program, self.motion_of, self.moving, N, Space.POWER)

    def _drift(self, program: Program, e: Element, N: list[Slot], out: Slot) -> None:
        rows = program.scratch_slot(len(e.needs))
        if e.joint.cut:
            c, ft = self.closing(e.joint), self.transmitted(program, e.joint, [])
            self.scene.add_wrenches(program, c, "gat", {row: i for i, row in enumerate(self.active)}, ft, 1)
            self.pin_of_cut(program, e, ft, rows)
        else:
            self.pin(program, e, N[e.joint.child], rows)
        primitive, v = friction.drift(self.scene.key_of(e)), self.motion_of(e.joint)[1]
        self.scene.call(program, primitive, N=rows, r=v, out=out, **element_operands(self.scene, program, e))
