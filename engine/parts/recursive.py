"""Tapes of scenes whose friction is found along the recursion (``articulated``), without maps: the motion, the articulated inertias
with ∂law/∂N, reactions of frictions, and ẏ. Of trees, or with what ``coupled`` adds of many loops."""

from __future__ import annotations

from engine.parts.blocks import Moving
from engine.parts.coupled import Coupled
from engine.parts.places import coordinate_rates, lengths_of
from engine.parts.stepping import Stepping
from engine.parts.store import friction
from engine.parts.tape import Block, Builtin, Space, Tape
from engine.system.elements import Element
from engine.system.structure import GROUND, Joint

INERTIA = 36
"""Numbers of an inertia that is not symmetric."""


class Recursive:
    """Writes them behind those of ``stepping``, which is of a scene with friction."""

    def __init__(self, stepping: Stepping):
        self.stepping, self.scene, self.system = stepping, stepping.scene, stepping.system
        self.element = {e.joint.child: e for e in stepping.parts if not e.joint.cut}
        count = len(self.system.bodies)
        self.slim = [stepping.w_block(p.sizes["slim"]) for p in self.scene.parts]
        self.Z, self.N, self.F = ([stepping.w_block(6) for _ in range(count)] for _ in range(3))
        self.y, self.qdd = stepping.w_block(self.system.nv), stepping.w_block(self.system.nv)
        self.one = self.scene.constant([1.0] * max((j.kind.nv for j in self.system.tree), default=1))
        self.none = self.scene.constant([0.0] * INERTIA)
        self.coupled = Coupled(self) if self.system.cuts else None
        self._begin()
        self._narrow()
        self._respond()
        self._answer()
        stepping.write_derivative(self.scene.tape("derive"), self.qdd, self.Z)

    def _begin(self) -> None:
        """The motion and what acts, as stage 1 begins; rates."""
        tape = self.scene.tape("begin")
        tape.code += self.stepping.begun.code
        tape.scratch = self.stepping.begun.scratch
        self.stepping.write_rates(tape)
        if self.coupled:
            self.coupled.begin(tape)
            self.coupled.shift(self.scene.tape("shift"))
        nq = self.system.nq
        coordinate_rates(self.scene, tape, Block(Space.Y, nq, self.system.nv), Block(Space.DY, 0, nq))

    def _own(self, j: Joint, which: Space, tape: Tape) -> Block:
        """Numbers of a joint's free freedoms, from those of all multipliers."""
        all_of = Block(which, min(self.element[j.child].eta), j.kind.nv)
        if len(j.free) == j.kind.nv:
            return all_of
        out = tape.scratch_block(len(j.free))
        tape.call(Builtin.PICK, [all_of, out], [len(j.free), *j.free])
        return out

    def _narrow(self) -> None:
        tape, s = self.scene.tape("narrow"), self.stepping
        count = len(self.system.bodies)
        borne, dn = tape.scratch_block(INERTIA * (count + 1)), 0
        tape.zero(borne)
        grips = {}
        for e in s.parts:
            j, n = e.joint, len(e.needs)
            if not j.cut:
                grips[j.child] = tape.scratch_block(6 * len(j.free))
                tape.zero(grips[j.child])
            if n and not j.cut:
                part = friction.grip(j.kind_name, j.forward, j.fit, e.needs, tuple(j.free))
                self.scene.call(tape, part, pose=s.moving[j.child].pose, dN=Block(Space.DN, dn, j.kind.nv * n),
                                out=grips[j.child], **lengths_of(self.scene, j))  # fmt: skip
            dn += j.kind.nv * n
        for i in reversed(range(count)):
            j, parent = self.system.tree[i], self.scene.parent(i)
            moves = self._own(j, Space.U, tape) if i in self.element else self.one
            self.scene.body_call(
                tape, i, "narrow", work=s.moving[i].work, turned=borne.part(INERTIA * i, INERTIA), grip=grips.get(i, self.none),
                moves=moves, slim=self.slim[i], pivot=Block(Space.OUT, i, 1),
                borne=borne.part(INERTIA * (parent if parent != GROUND else count), INERTIA),
            )  # fmt: skip
        if self.coupled:
            self.coupled.narrow(tape)

    def _along(self, tape: Tape, j: Joint, m: Moving, less: Block | None) -> Block:
        """Forces along a joint's free freedoms: of its devices, and what friction is besides its law's derivative, −e."""
        if less is not None and not self.scene.acts(j):
            return less
        out = tape.scratch_block(len(j.free))
        tape.call(Builtin.PICK, [m.effort, out], [len(j.free), *j.free])
        if less is not None:
            tape.call(Builtin.ADD, [less, out], [len(j.free)])
        return out

    def _respond(self) -> None:
        """Reaction components (N), what joints transmit along their freedoms less their devices, accelerations."""
        tape, s, scene = self.scene.tape("respond"), self.stepping, self.scene
        count = len(self.system.bodies)
        handed = tape.scratch_block(6 * (count + 1))
        tape.zero(handed)
        forces = self.coupled.forces(tape) if self.coupled else [m.force for m in s.moving]
        for i in reversed(range(count)):
            j, m, parent = self.system.tree[i], s.moving[i], scene.parent(i)
            along = self._along(tape, j, m, self._own(j, Space.U, tape) if i in self.element else None)
            up = handed.part(6 * (parent if parent != GROUND else count), 6)
            scene.body_call(tape, i, "pull", work=m.work, slim=self.slim[i], fc=handed.part(6 * i, 6), force=forces[i], yc=along,
                            y=s.own(self.y, j), F=self.F[i], up=up)  # fmt: skip
        if self.coupled:
            self.coupled.solve(tape)
        borne = self._outward(tape)
        if self.coupled and self.coupled.again(tape, self.Z):
            borne = self._outward(tape)
        for i, e in self.element.items():
            self._found(tape, e, borne[i])
        if self.coupled:
            self.coupled.found(tape, self.Z)

    def _outward(self, tape: Tape) -> list[Block]:
        """Accelerations, reactions and their parts along the free freedoms (each joint's), from y and F."""
        s, scene, out = self.stepping, self.scene, []
        for i, j in enumerate(self.system.tree):
            fq, parent = tape.scratch_block(len(j.free)), scene.parent(i)
            carrier = scene.base if parent == GROUND else self.Z[parent]
            scene.body_call(tape, i, "push", work=s.moving[i].work, slim=self.slim[i], Z=carrier, yc=s.own(self.y, j),
                            fc=self.F[i], qdd=s.own(self.qdd, j), Zo=self.Z[i], N=self.N[i], fq=fq)  # fmt: skip
            out.append(fq)
        return out

    def _found(self, tape: Tape, e: Element, fq: Block) -> None:
        j, m, s = e.joint, self.stepping.moving[e.joint.child], self.stepping
        first = min(e.eta)
        s.pin(tape, e, self.N[j.child], Block(Space.N, e.n0, len(e.needs)))
        for k in range(j.kind.nv):
            borne, acceleration = Block(Space.OUT, first + k, 1), Block(Space.A, first + k, 1)
            if k not in j.free:
                tape.zero(borne)
                tape.copy(m.known.part(k, 1), acceleration)
                continue
            at = j.free.index(k)
            tape.copy(fq.part(at, 1), borne)
            if self.scene.acts(j):
                tape.call(Builtin.PRODUCT, [m.effort.part(k, 1), self.scene.one, borne], [1, -1])
            tape.copy(s.own(self.qdd, j).part(at, 1), acceleration)

    def _answer(self) -> None:
        """Reaction components and accelerations under frictions that are given (−η), by the reduction without them."""
        tape, s, scene = self.scene.tape("answer"), self.stepping, self.scene
        efforts: list[Block] = []
        for i, j in enumerate(self.system.tree):
            effort = s.moving[i].effort
            if i in self.element:
                given, own = Block(Space.U, min(self.element[i].eta), j.kind.nv), effort
                effort = given
                if scene.acts(j):
                    effort = tape.scratch_block(j.kind.nv)
                    tape.copy(own, effort)
                    tape.call(Builtin.ADD, [given, effort], [j.kind.nv])
            efforts.append(effort)
        y, F = s.write_inward(tape, efforts, forces=self.coupled.given(tape) if self.coupled else None)
        qdd, Z, N = s.accelerate(tape, y, F, "accelerations", range(len(F)), scene.base)
        if self.coupled:
            self.coupled.gaps(tape, Z)
        for e in self.element.values():
            j, known = e.joint, s.moving[e.joint.child].known
            s.pin(tape, e, N[j.child], Block(Space.N, e.n0, len(e.needs)))
            for k in range(j.kind.nv):
                found = s.own(qdd, j).part(j.free.index(k), 1) if k in j.free else known.part(k, 1)
                tape.copy(found, Block(Space.A, min(e.eta) + k, 1))
