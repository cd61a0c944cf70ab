"""Programs that solve friction along the recursion, without maps. The programs compute motion, articulated inertias with ∂law/∂N
(``articulated_inertias``), the response to friction, and ẏ. This module is for trees; ``recursive_friction_loops`` adds loops."""

from __future__ import annotations

from trunnion.parts.bytecode.body_and_joint_slots import BodySlots, free_of
from trunnion.parts.bytecode.program import NOWHERE, Builtin, Program, Slot, Space
from trunnion.parts.primitives.primitive_cache import friction
from trunnion.parts.programs.evaluation_stages import EvaluationPrograms
from trunnion.parts.programs.recursive_friction_loops import LoopFriction
from trunnion.parts.programs.shared_operands import coordinate_rates, lengths_of
from trunnion.system.structure.bodies_and_joints import GROUND, Joint
from trunnion.system.structure.friction_joint_indices import Element

INERTIA = 36
"""Number of doubles of an unsymmetric inertia."""


class RecursiveFriction:
    """Writes the programs of this module, for a scene with friction. The class needs the programs of ``stepping``."""

    def __init__(self, stepping: EvaluationPrograms):
        self.stepping, self.scene, self.system = stepping, stepping.scene, stepping.system
        self.element = {e.joint.child: e for e in stepping.elements if not e.joint.cut}
        count = len(self.system.bodies)
        self.slim = [stepping.kept_slot(p.sizes["slim"]) for p in self.scene.body_primitives]
        self.Z, self.N, self.F = ([stepping.kept_slot(6) for _ in range(count)] for _ in range(3))
        self.y, self.qdd = stepping.kept_slot(self.system.nv), stepping.kept_slot(self.system.nv)
        self.one = self.scene.constant([1.0] * max((j.kind.nv for j in self.system.tree), default=1))
        self.none = self.scene.constant([0.0] * INERTIA)
        self.coupled = LoopFriction(stepping, self.slim, self.y, self.F) if self.system.cuts else None
        self._begin()
        self._narrow()
        self._respond()
        self._answer()
        stepping.write_derivative(self.scene.program("derive"), self.qdd, self.Z)

    def _begin(self) -> None:
        """Write motion and forces, like the start of stage 1, then the rates."""
        program = self.scene.program("begin")
        program.code += self.stepping.begun.code
        program.scratch = self.stepping.begun.scratch
        self.stepping.write_rates(program)
        if self.coupled:
            self.coupled.begin(program)
            self.coupled.shift(self.scene.program("shift"))
        nq = self.system.nq
        coordinate_rates(self.scene, program, Slot(Space.Y, nq, self.system.nv), Slot(Space.DY, 0, nq))

    def _own(self, j: Joint, which: Space, program: Program) -> Slot:
        """The part of an array of friction multipliers that belongs to the free freedoms of a joint."""
        all_of = Slot(which, min(self.element[j.child].eta), j.kind.nv)
        if len(j.free) == j.kind.nv:
            return all_of
        out = program.scratch_slot(len(j.free))
        program.call(Builtin.SELECT, [all_of, out], [len(j.free), *j.free])
        return out

    def _narrow(self) -> None:
        program, s = self.scene.program("narrow"), self.stepping
        count = len(self.system.bodies)
        borne, dn = program.scratch_slot(INERTIA * count), 0
        program.zero(borne)
        grips = {}
        for e in s.elements:
            j, n = e.joint, len(e.needs)
            if not j.cut:
                grips[j.child] = program.scratch_slot(6 * len(j.free))
                program.zero(grips[j.child])
            if n and not j.cut:
                primitive = friction.grip(j.kind_name, j.forward, j.fit, e.needs, tuple(j.free))
                self.scene.call(program, primitive, pose=s.moving[j.child].pose, dN=Slot(Space.DN, dn, j.kind.nv * n),
                                out=grips[j.child], **lengths_of(self.scene, j))  # fmt: skip
            dn += j.kind.nv * n
        for i in reversed(range(count)):
            j, parent = self.system.tree[i], self.scene.parent(i)
            moves = self._own(j, Space.U, program) if i in self.element else self.one
            self.scene.body_call(
                program, i, "narrow", work=s.moving[i].work, turned=borne.slice(INERTIA * i, INERTIA), grip=grips.get(i, self.none),
                moves=moves, slim=self.slim[i], pivot=Slot(Space.OUT, i, 1),
                borne=borne.slice(INERTIA * parent, INERTIA) if parent != GROUND else NOWHERE,
            )  # fmt: skip
        if self.coupled:
            self.coupled.narrow(program)

    def _along(self, program: Program, j: Joint, m: BodySlots, less: Slot | None) -> Slot:
        """Forces along a joint's free freedoms: the device forces plus ``less``. ``less`` is −e, the remainder of the linearised
        friction law."""
        if less is not None and not self.scene.acts(j):
            return less
        out = program.scratch_slot(len(j.free))
        program.call(Builtin.SELECT, [m.effort, out], [len(j.free), *j.free])
        if less is not None:
            program.call(Builtin.ADD, [less, out], [len(j.free)])
        return out

    def _respond(self) -> None:
        """Write the reaction components N, the accelerations, and the transmitted forces along freedoms minus device forces."""
        program, s, scene = self.scene.program("respond"), self.stepping, self.scene
        count = len(self.system.bodies)
        handed = program.scratch_slot(6 * count)
        program.zero(handed)
        forces = self.coupled.forces(program) if self.coupled else [m.force for m in s.moving]
        for i in reversed(range(count)):
            j, m, parent = self.system.tree[i], s.moving[i], scene.parent(i)
            along = self._along(program, j, m, self._own(j, Space.U, program) if i in self.element else None)
            up = handed.slice(6 * parent, 6) if parent != GROUND else NOWHERE
            scene.body_call(program, i, "pull", work=m.work, slim=self.slim[i], fc=handed.slice(6 * i, 6), force=forces[i],
                            yc=along, y=free_of(self.y, j), F=self.F[i], up=up)  # fmt: skip
        if self.coupled:
            self.coupled.solve(program)
        borne = self._outward(program)
        if self.coupled and self.coupled.refine(program, self.Z):
            borne = self._outward(program)
        for i, e in self.element.items():
            self._found(program, e, borne[i])
        if self.coupled:
            self.coupled.found(program, self.Z)

    def _outward(self, program: Program) -> list[Slot]:
        """Write accelerations and reactions from y and F. Returns the reaction of each joint along its free freedoms."""
        s, scene, out = self.stepping, self.scene, []
        for i, j in enumerate(self.system.tree):
            fq, carrier = program.scratch_slot(len(j.free)), scene.acceleration(self.Z, scene.parent(i))
            scene.body_call(program, i, "push", work=s.moving[i].work, slim=self.slim[i], Z=carrier, yc=free_of(self.y, j),
                            fc=self.F[i], qdd=free_of(self.qdd, j), Zo=self.Z[i], N=self.N[i], fq=fq)  # fmt: skip
            out.append(fq)
        return out

    def _found(self, program: Program, e: Element, fq: Slot) -> None:
        j, m, s = e.joint, self.stepping.moving[e.joint.child], self.stepping
        first = min(e.eta)
        s.pin(program, e, self.N[j.child], Slot(Space.N, e.n0, len(e.needs)))
        for k in range(j.kind.nv):
            borne = Slot(Space.OUT, first + k, 1)
            if k in j.free:
                program.copy(fq.slice(j.free.index(k), 1), borne)
                if self.scene.acts(j):
                    program.call(Builtin.ADD_DOT, [m.effort.slice(k, 1), self.scene.one, borne], [1, -1])
            else:
                program.zero(borne)
        for k in range(j.kind.nv):
            program.copy(self.scene.freedom_acceleration(j, k, m, self.qdd), Slot(Space.A, first + k, 1))

    def _answer(self) -> None:
        """Write reaction components and accelerations for given friction forces −η, by the reduction without friction."""
        program, s, scene = self.scene.program("answer"), self.stepping, self.scene
        efforts: list[Slot] = []
        for i, j in enumerate(self.system.tree):
            effort = own = s.moving[i].effort
            if i in self.element:
                effort = given = Slot(Space.U, min(self.element[i].eta), j.kind.nv)
                if scene.acts(j):
                    effort = program.scratch_slot(j.kind.nv)
                    program.copy(own, effort)
                    program.call(Builtin.ADD, [given, effort], [j.kind.nv])
            efforts.append(effort)
        y, F = s.write_inward(program, efforts, forces=self.coupled.given(program) if self.coupled else None)
        qdd, Z, N = s.accelerate(program, y, F, "accelerations", range(len(F)), scene.base)
        if self.coupled:
            self.coupled.gaps(program, Z)
        for e in self.element.values():
            j = e.joint
            s.pin(program, e, N[j.child], Slot(Space.N, e.n0, len(e.needs)))
            for k in range(j.kind.nv):
                found = scene.freedom_acceleration(j, k, s.moving[j.child], qdd)
                program.copy(found, Slot(Space.A, min(e.eta) + k, 1))
