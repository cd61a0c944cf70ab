"""Passes that several programs of a step use: motion, inward reduction, transmitted wrenches."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from trunnion.kernel.interface.runtime_tables import HANDED
from trunnion.parts.bytecode.body_and_joint_slots import Allocate, BodySlots, CutJointSlots, free_of
from trunnion.parts.bytecode.program import NOWHERE, Builtin, Program, Slot, Space
from trunnion.parts.layout.loop_matrix import LoopMatrix
from trunnion.parts.layout.multiplier_maps_layout import Maps
from trunnion.parts.primitives.primitive_cache import signals_loads_energies
from trunnion.parts.programs.body_passes import ScenePasses
from trunnion.parts.programs.scaled_reactions import ScaledReactions
from trunnion.parts.programs.shared_operands import lengths_of, write_pin, write_span
from trunnion.system.structure.bodies_and_joints import GROUND, Joint
from trunnion.system.structure.friction_joint_indices import Element, any_sets, elements
from trunnion.system.structure.loop_matrix_fill import coupled, fill, rows_by_loop


class EvaluationPasses:
    """Writes the outward and inward pass at the start of stage 1. active: rows of cut joints with a multiplier. redundant: whether
    the maps contain the scaled reactions."""

    def __init__(self, scene: ScenePasses, active: Sequence[int] = (), redundant: bool = False):
        self.scene, self.system = scene, scene.system
        self.elements, self.active = elements(self.system), tuple(active)
        s = self.system
        states = len(s.bristles)
        nrates = sum(e.joint.kind.nv for e in self.elements) + (states if self.elements else 0)
        self.shares = ScaledReactions(scene) if redundant else None
        shared = self.shares.size if self.shares else 0
        needs = sum(len(e.needs) for e in self.elements)
        self.maps = Maps(len(self.active), s.neta, needs, nrates, any_sets(s), shared, self._loop_matrix())
        scene.multipliers = len(self.active)
        scene.bare = not s.neta
        self.nw = 0
        program = scene.program("stage1")
        self.moving = scene.outward(program, self.kept_slot)
        self.closed = scene.closed(program, self.moving, self.kept_slot)
        self._closing = {c.joint.name: c for c in self.closed}
        self.begun = Program(program.code[:], program.scratch)
        self.kept = [self.kept_slot(p.sizes["kept"]) for p in scene.body_primitives]
        self.y, self.F = self.write_inward(program, [m.effort for m in self.moving], self.kept_slot)
        self.asked = bool(self.elements or self.shares)

    def _loop_matrix(self) -> LoopMatrix | None:
        """Layout of S if few loops share bodies and no joint has friction."""
        f = fill(self.system, self.active)
        if self.system.neta or not f.below:
            return None
        loops = rows_by_loop(self.system, self.active)
        return LoopMatrix([rows for _, rows in loops], coupled(self.system, [c for c, _ in loops]), f, symmetric=True)

    def motion_of(self, j: Joint) -> tuple[Slot, Slot]:
        """Coordinates and rates of a joint."""
        found = self.closing(j) if j.cut else self.moving[j.child]
        return found.q, found.v

    def closing(self, j: Joint) -> CutJointSlots:
        """The slots of a cut joint."""
        return self._closing[j.name]

    def kept_slot(self, size: int) -> Slot:
        """A slot in W, which other functions of the kernel can read."""
        self.nw += size
        return Slot(Space.W, self.nw - size, size)

    def write_inward(
        self, program: Program, efforts: Sequence[Slot], allocate: Allocate | None = None, forces: Sequence[Slot] | None = None
    ) -> tuple[Slot, list[Slot]]:
        """Write the inward pass. efforts: forces along the freedoms of each joint. forces: wrenches on the bodies; by default, the
        wrenches of the scene. Returns y (nv), the accelerations of the freedoms for Ż = 0 of the inboard body, and the wrench on
        each body (6)."""
        s, n = self.scene, len(self.system.bodies)
        y, F = (allocate or program.scratch_slot)(self.system.nv), [(allocate or program.scratch_slot)(6) for _ in range(n)]
        handed = [program.scratch_slot(HANDED) for _ in range(n)]
        for h in handed:
            program.zero(h)
        for i in reversed(range(n)):
            m, j = self.moving[i], self.system.tree[i]
            up = handed[s.parent(i)] if s.parent(i) != GROUND else NOWHERE
            s.body_call(program, i, "inward", work=m.work, kept=self.kept[i], handed=handed[i],
                        force=forces[i] if forces else m.force, effort=efforts[i], up=up,
                        y=free_of(y, j), F=F[i], known=m.known)  # fmt: skip
        return y, F

    def accelerate(
        self, program: Program, y: Slot, F: list[Slot], function: str, bodies: Iterable[int], base: Slot
    ) -> tuple[Slot, list[Slot], list[Slot]]:
        """Write the outward pass from accelerations y. Returns q̈ (nv), and Ż and N of each body."""
        s, n = self.scene, len(self.system.bodies)
        qdd = program.scratch_slot(self.system.nv)
        Z, N = ([program.scratch_slot(6) for _ in range(n)] for _ in range(2))
        for i in bodies:
            m, j, parent = self.moving[i], self.system.tree[i], s.parent(i)
            s.body_call(program, i, function, work=m.work, kept=self.kept[i], Z=base if parent == GROUND else Z[parent],
                        yc=free_of(y, j), fc=F[i], qdd=free_of(qdd, j), Zo=Z[i], N=N[i], known=m.known)  # fmt: skip
        return qdd, Z, N

    def write_rates(self, program: Program) -> None:
        """Write the rates of the freedoms of frictional joints, and the states of their laws."""
        m, states = self.maps, len(self.system.bristles)
        for e in self.elements:
            nv = e.joint.kind.nv
            program.copy(self.motion_of(e.joint)[1].slice(0, nv), Slot(Space.MAPS, m.at("rates") + e.rate0, nv))
        at = m.at("rates") + m.nrates - states
        program.copy(Slot(Space.Y, self.system.nq + self.system.nv, states), Slot(Space.MAPS, at, states))

    def where(self) -> dict[str, BodySlots | CutJointSlots]:
        """Slots of every joint by name."""
        return {j.name: m for j, m in zip(self.system.tree, self.moving, strict=True)} | {c.joint.name: c for c in self.closed}

    def transmitted(self, program: Program, j: Joint, N: Sequence[Slot]) -> Slot:
        """Wrench on a joint's outboard part without multipliers (6). N: reactions of tree joints."""
        ft = program.scratch_slot(6)
        if j.cut:
            self.scene.outboard_wrench(program, j, self.closing(j), self.scene.zeros, ft)
        else:
            self.scene.outboard_wrench(program, j, self.moving[j.child], N[j.child], ft)
        return ft

    def along_cut(self, program: Program, c: CutJointSlots, Z: Sequence[Slot], out: Slot) -> None:
        """Add the effect of the accelerations Z of a cut joint's two bodies to ``out``, the accelerations of the joint's
        freedoms."""
        for which, z in zip(("win", "wout"), Z, strict=True):
            program.call(Builtin.ADD_ROW_DOTS, [c.blocks[which], z, out], [6, c.joint.kind.nv, 6, 1])

    def pin_of_cut(self, program: Program, e: Element, ft: Slot, out: Slot, whole: bool = True) -> None:
        """Write the components of f_c, m_c that a cut joint's law needs, from the wrench on the joint's outboard part. whole:
        whether this wrench is the total wrench, and not the wrench of one multiplier."""
        j, pose = e.joint, self.closing(e.joint).pose
        write_pin(self.scene, program, j, e.needs, ft, pose, out)
        if whole:
            write_span(self.scene, program, j, e.needs, pose, out)

    def pin(self, program: Program, e: Element, N: Slot, out: Slot, whole: bool = True) -> None:
        """Write the components of f_c, m_c that a tree joint's law needs, from the reaction N. whole: see ``pin_of_cut``."""
        j, pose = e.joint, self.moving[e.joint.child].pose
        if e.needs:
            primitive = signals_loads_energies.pin(j.kind_name, j.forward, j.fit, e.needs)
            self.scene.call(program, primitive, N=N, pose=pose, out=out, **lengths_of(self.scene, j))
        if whole:
            write_span(self.scene, program, j, e.needs, pose, out)
