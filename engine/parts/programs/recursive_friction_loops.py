"""Multipliers of cut joints in programs that solve friction along the recursion. The columns and rows of a loop extend only over
the path of this loop (theory, "Friction along the recursion").

With friction, the response to a multiplier is not the transpose of its row of the constraint equations. Force columns and
constraint rows are therefore stored separately, and S is unsymmetric. The friction of a cut joint itself changes only the columns
of its multipliers."""

from __future__ import annotations

from itertools import product

from trunnion.parts.bytecode.body_and_joint_slots import CutJointSlots, free_of
from trunnion.parts.bytecode.program import Builtin, Program, Slot, Space
from trunnion.parts.layout.loop_matrix import LoopMatrix
from trunnion.parts.programs.evaluation_passes import EvaluationPasses
from trunnion.parts.programs.loop_slots import CutJointFriction, FrictionLoop, path_slots
from trunnion.system.structure.bodies_and_joints import GROUND
from trunnion.system.structure.loop_matrix_fill import MANY_ROWS, coupled, fill, pattern, rows_by_loop


class LoopFriction:
    """The loops of a scene whose friction is solved along the recursion. slim: values that ``narrow`` stores for each body. y (nv),
    F (6 for each body): results of the inward pass, to which this class adds the effect of the loops' multipliers."""

    def __init__(self, stepping: EvaluationPasses, slim: list[Slot], y: Slot, F: list[Slot]):
        self.stepping, self.slim, self.y, self.F = stepping, slim, y, F
        self.scene, self.system, self.active = self.stepping.scene, self.stepping.system, len(self.stepping.active)
        room, a = self.stepping.kept_slot, self.active
        self.free = [len(j.free) for j in self.system.tree]
        found = rows_by_loop(self.system, self.stepping.active)
        self.near = coupled(self.system, [c for c, _ in found])
        f = pattern(self.system, self.stepping.active)
        self.matrix, entries = LoopMatrix([rows for _, rows in found], self.near, f, symmetric=False), len(f.below)
        self.S, self.low, self.high = room(self.matrix.size), room(a + entries), room(entries)
        self.gap, self.lam, self.more = room(a), room(a), room(a)
        self.refines = a >= MANY_ROWS and not fill(self.system, self.stepping.active).below
        self.listed = [a, *f.order, *f.start, *f.below]
        self.rubbing = {e.joint.name: e for e in self.stepping.elements if e.joint.cut}
        self.loops: list[FrictionLoop] = [self._loop(self.stepping.closing(c), rows) for c, rows in found]
        self.pivots = Slot(Space.OUT, len(self.system.bodies), len(self.stepping.elements) + 2 * a)

    # -- slots and coefficients ---------------------------------------------------------------------------------------------

    def _loop(self, c: CutJointSlots, rows: list[int]) -> FrictionLoop:
        room, n = self.stepping.kept_slot, len(rows)
        slots = path_slots(self.stepping, c, rows, room)
        made = FrictionLoop(*slots, sensed=room(slots[-1].size))
        e = self.rubbing.get(c.joint.name)
        if e:
            nv, needs = c.joint.kind.nv, len(e.needs)
            sizes = (needs * n, needs * nv, needs, nv * nv, nv * n, nv, nv)
            made.friction = CutJointFriction(e, *(room(size) for size in sizes))
        return made

    def begin(self, program: Program) -> None:
        """Write p0, ``by_rows`` and ``by_friction`` of cut joints with friction (``CutJointFriction``)."""
        for loop in self.loops:
            r, c = loop.friction, loop.closed
            if not r:
                continue
            needs, pin = len(r.element.needs), self.stepping.pin_of_cut
            for k, row in enumerate(loop.own):
                pin(program, r.element, c.row("gat", row), r.by_rows.slice(needs * k, needs), False)
            for k in range(c.joint.kind.nv):
                pin(program, r.element, c.row("wat", k), r.by_friction.slice(needs * k, needs), False)
            pin(program, r.element, self.stepping.transmitted(program, c.joint, []), r.p0)

    # -- with the laws' derivatives -----------------------------------------------------------------------------------------

    def narrow(self, program: Program) -> None:
        """Write columns, rows and the factors of S with the laws' derivatives. The pivots of bodies come first, then the pivots of
        elements, the pivots of S, and the diagonal of S."""
        count, dn, at = len(self.stepping.elements), {}, 0
        program.copy(self.scene.constant([1.0] * count), self.pivots)
        for e in self.stepping.elements:
            dn[e.joint.name] = Slot(Space.DN, at, e.joint.kind.nv * len(e.needs))
            at += dn[e.joint.name].size
        for number, loop in enumerate(self.loops):
            self._wrenches(program, loop, dn)
            for k in range(len(loop.rows)):
                self._column(program, loop, k)
            for other in sorted(k for k in (number, *self.near[number]) if k <= number):
                loop.meet(program, self.loops[other], self.matrix, self.S)
        own = self.pivots.slice(count, 2 * self.active)
        f, index = self.matrix.fill, self.matrix.at
        diagonal, row, pivot, entry = [index(r, r) for r in f.order], *f.by_row()
        both = [*f.entries(index), *f.entries(lambda i, k: index(k, i))]
        program.call(
            Builtin.FACTOR_LOOPS, [self.S, self.low, self.high, own], [*self.listed, *diagonal, *both, *row, *pivot, *entry]
        )

    def _wrenches(self, program: Program, loop: FrictionLoop, dn: dict[str, Slot]) -> None:
        """Write columns and rows on the two bodies of the cut joint. Columns and rows differ by the friction of this joint."""
        c, j, r = loop.closed, loop.closed.joint, loop.friction
        how = [loop.stride, loop.offsets[j.inb], loop.offsets[j.out], len(loop.own), *loop.own]
        for out in (loop.pressed, loop.sensed):
            program.call(Builtin.WRENCH_COLUMNS, [c.blocks["gin"], c.blocks["gout"], out], how)
            for (body, g), (k, row) in product(c.ends[2:], enumerate(loop.own)):
                program.call(Builtin.ADD, [c.row(g, row), loop.on(out, body, k)], [6])
        if not r:
            return
        nv, n = j.kind.nv, len(loop.own)
        det = self.pivots.slice(self.stepping.elements.index(r.element), 1)
        operands = [dn[j.name], r.by_friction, r.by_rows, r.p0, r.inverse, r.turned, r.less, det]
        program.call(Builtin.CUT_JOINT_FRICTION, operands, [nv, len(r.element.needs), n])
        for k in range(n):
            for body, w in ((j.inb, "win"), (j.out, "wout")):
                program.call(
                    Builtin.ADD_COLUMNS, [c.blocks[w], r.turned.slice(nv * k, nv), loop.on(loop.pressed, body, k)], [6, nv]
                )

    def _column(self, program: Program, loop: FrictionLoop, k: int) -> None:
        """Reduce force column k and constraint row k of a loop inward, along the path of the loop."""
        for i in reversed(loop.at):
            parent = self.scene.parent(i)
            y, along = (b.slice(loop.size * k + loop.at[i], self.free[i]) for b in (loop.y, loop.along))
            self._call(program, i, "press", fc=loop.on(loop.pressed, i, k), yc=y, up=loop.on(loop.pressed, parent, k))
            self._call(program, i, "sense", fc=loop.on(loop.sensed, i, k), fq=along, up=loop.on(loop.sensed, parent, k))

    def _call(self, program: Program, i: int, name: str, **operands: Slot) -> None:
        self.scene.body_call(program, i, name, work=self.stepping.moving[i].work, slim=self.slim[i], **operands)

    # -- solution for the multipliers -----------------------------------------------------------------------------------------

    def forces(self, program: Program) -> list[Slot]:
        """Wrench on each body, with the known part of the friction of cut joints."""
        found = [m.force for m in self.stepping.moving]
        for loop in self.loops:
            r = loop.friction
            if r:
                nv = loop.closed.joint.kind.nv
                program.copy(r.less, r.eta)
                program.call(Builtin.ADD_STRIDED_COLUMNS, [r.inverse, Slot(Space.U, min(r.element.eta), nv), r.eta], [nv, nv, nv])
                self._act(program, loop.closed, r.eta, found)
        return found

    def _act(self, program: Program, c: CutJointSlots, less: Slot, found: list[Slot]) -> None:
        """Add the friction −η (``less``) of a cut joint to the wrenches on its bodies."""
        for body, w in ((c.joint.inb, "win"), (c.joint.out, "wout")):
            if body != GROUND:
                program.call(Builtin.ADD_COLUMNS, [c.blocks[w], less, self._own(program, found, body)], [6, c.joint.kind.nv])

    def _own(self, program: Program, found: list[Slot], i: int) -> Slot:
        """Slot in which the wrench on a body may be changed. The first request copies the wrench to a new slot."""
        if found[i] is self.stepping.moving[i].force:
            found[i] = program.scratch_slot(6)
            program.copy(self.stepping.moving[i].force.slice(0, 6), found[i])
        return found[i]

    def solve(self, program: Program) -> None:
        """Write λ from S λ + g = 0, where g follows from the accelerations y without multipliers. Then add the effect of λ to y and
        F."""
        base = len(self.system.bodies)
        for loop in self.loops:
            n, g = len(loop.rows), loop.of(self.gap)
            program.call(Builtin.SELECT, [loop.closed.blocks["xi"], g], [n, *loop.own])
            for first, count, free in [*loop.runs(), (GROUND, 1, 0)]:
                at = 6 * (base if first == GROUND else first)
                bias = [loop.on(loop.sensed, first, 0), self.scene.all_bias.slice(at, 6 * count), g]
                program.call(Builtin.ADD_TRANSPOSED_PRODUCT, bias, [6 * count, n, loop.stride])
                if free:
                    known = self.y.slice(self.system.tree[first].v0, free)
                    program.call(
                        Builtin.ADD_TRANSPOSED_PRODUCT, [loop.along.slice(loop.at[first], free), known, g], [free, n, loop.size]
                    )
        program.call(Builtin.SOLVE_LOOPS, [self.low, self.high, self.gap, self.lam], self.listed)
        self._add(program, self.lam)

    def refine(self, program: Program, Z: list[Slot]) -> bool:
        """If there are many loops, and all of them share bodies, correct the multipliers once by the remaining residual. Returns
        whether the multipliers were corrected. (For a ladder with a hundred rungs, the condition number of S is 1e8.)"""
        if self.refines:
            self._left(program, self.gap, Z)
            program.call(Builtin.SOLVE_LOOPS, [self.low, self.high, self.gap, self.more], self.listed)
            self._add(program, self.more)
            program.call(Builtin.ADD, [self.more, self.lam], [self.active])
        return self.refines

    def _add(self, program: Program, lam: Slot) -> None:
        """Add the effect of the multipliers ``lam`` to y and F."""
        for loop in self.loops:
            loop.respond(program, lam, self.y)
            for first, count, _ in loop.runs():
                program.call(Builtin.ADD_STRIDED_COLUMNS, [loop.on(loop.pressed, first, 0), loop.of(lam), self.F[first]],
                          [6 * count, len(loop.rows), loop.stride])  # fmt: skip

    def found(self, program: Program, Z: list[Slot]) -> None:
        """Write λ, and the reaction components and accelerations of cut joints with friction."""
        program.copy(self.lam, Slot(Space.OUT, self.system.neta, self.active))
        for loop in self.loops:
            if loop.friction:
                nv, first, lam = loop.closed.joint.kind.nv, min(loop.friction.element.eta), loop.of(self.lam)
                program.call(Builtin.ADD_STRIDED_COLUMNS, [loop.friction.turned, lam, loop.friction.eta], [nv, len(loop.rows), nv])
                program.zero(Slot(Space.OUT, first, nv))
                self._told(program, loop, lam, loop.friction.eta, Z)

    def _told(self, program: Program, loop: FrictionLoop, lam: Slot, less: Slot, Z: list[Slot]) -> None:
        """Write reaction components and accelerations of a cut joint, from multipliers and −η (``less``)."""
        r, c = loop.friction, loop.closed
        assert r is not None
        nv, needs, first = c.joint.kind.nv, len(r.element.needs), min(r.element.eta)
        out, acceleration = Slot(Space.N, r.element.n0, needs), Slot(Space.A, first, nv)
        program.copy(r.p0, out)
        program.call(Builtin.ADD_STRIDED_COLUMNS, [r.by_rows, lam, out], [needs, len(loop.rows), needs])
        program.call(Builtin.ADD_STRIDED_COLUMNS, [r.by_friction, less, out], [needs, nv, needs])
        program.copy(c.blocks["bias"], acceleration)
        self.stepping.along_cut(program, c, self._ends(c, Z), acceleration)

    def _ends(self, c: CutJointSlots, Z: list[Slot]) -> list[Slot]:
        return [self.scene.acceleration(Z, b) for b in (c.joint.inb, c.joint.out)]

    # -- given multipliers, and shift of rates --------------------------------------------------------------------------------

    def given(self, program: Program) -> list[Slot]:
        """Wrench on each body, with the forces of given multipliers λ and friction forces −η."""
        found = [m.force for m in self.stepping.moving]
        for loop in self.loops:
            c, j, lam = loop.closed, loop.closed.joint, self._given(loop)
            for body, g in c.ends:
                for k, row in enumerate(loop.own) if body != GROUND else ():
                    program.call(Builtin.ADD_COLUMNS, [c.row(g, row), lam.slice(k, 1), self._own(program, found, body)], [6, 1])
            if loop.friction:
                self._act(program, c, Slot(Space.U, min(loop.friction.element.eta), j.kind.nv), found)
        return found

    def _given(self, loop: FrictionLoop) -> Slot:
        return Slot(Space.U, self.system.neta + loop.rows[0], len(loop.rows))

    def gaps(self, program: Program, Z: list[Slot]) -> None:
        """Write the residuals of all rows under accelerations Ż, after the accelerations of the freedoms. Also write the reaction
        components and accelerations of cut joints with friction."""
        self._left(program, Slot(Space.A, self.system.neta, self.active), Z)
        for loop in self.loops:
            if loop.friction:
                less = Slot(Space.U, min(loop.friction.element.eta), loop.closed.joint.kind.nv)
                self._told(program, loop, self._given(loop), less, Z)

    def _left(self, program: Program, out: Slot, Z: list[Slot]) -> None:
        """Write the residual of each row under accelerations of the bodies."""
        for loop in self.loops:
            c, own = loop.closed, loop.of(out)
            program.call(Builtin.SELECT, [c.blocks["xi"], own], [len(loop.rows), *loop.own])
            for body, which in c.ends:
                z = self.scene.acceleration(Z, body)
                for k, row in enumerate(loop.own):
                    program.call(Builtin.ADD_DOT, [c.row(which, row), z, own.slice(k, 1)], [6, 1])

    def shift(self, program: Program) -> None:
        """Write the rates (nv) of least norm in the mass metric that change the constraint rows by −gap."""
        nv = self.system.nv
        program.call(Builtin.SOLVE_LOOPS, [self.low, self.high, Slot(Space.U, 0, self.active), self.lam], self.listed)
        y, Z = program.scratch_slot(nv), [program.scratch_slot(6) for _ in self.system.bodies]
        program.zero(y)
        for loop in self.loops:
            loop.respond(program, self.lam, y)
        for i, j in enumerate(self.system.tree):
            parent, own = self.scene.parent(i), free_of(y, j)
            qdd = Slot(Space.OUT, j.v0, len(j.free))
            before = self.scene.zeros if parent == GROUND else Z[parent]
            self._call(program, i, "swing", Z=before.slice(0, 6), yc=own, qdd=qdd, Zo=Z[i])
