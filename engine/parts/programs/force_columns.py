"""Columns of the affine maps. The unit force of each multiplier is reduced inward, from its joint to the ground. An outward pass
over the branch then computes accelerations and reactions.

Every column uses the same calls per body, in shared scratch. The results are copied into the maps."""

from __future__ import annotations

from array import array

from trunnion.parts.bytecode.body_and_joint_slots import free_of
from trunnion.parts.bytecode.program import Builtin, Program, Slot, Space
from trunnion.parts.programs.evaluation_passes import EvaluationPasses
from trunnion.system.structure.bodies_and_joints import GROUND, Joint
from trunnion.system.structure.friction_joint_indices import Element


class ForceColumns:
    """Writes calls that compute the maps from a unit of each multiplier. block: slot of the accelerations that these units cause
    (nv each), which stage 2 reads."""

    def __init__(self, stepping: EvaluationPasses, program: Program, block: Slot):
        self.stepping, self.program, self.block = stepping, program, block
        self.scene, self.system, self.maps = stepping.scene, stepping.system, stepping.maps
        n, nv = len(self.system.bodies), self.system.nv
        self.y, self.effort, self.qdd, self.fq = (program.scratch_slot(nv) for _ in range(4))
        self.pressed = program.scratch_slot(nv * self.maps.active)
        self.forces = program.scratch_slot(6 * (n + 1))
        self.rows, self.held = program.scratch_slot(self.maps.nn), program.scratch_slot(self.maps.ne)
        Z, N = program.scratch_slot(6 * n), program.scratch_slot(6 * n)
        self.Z = Z
        self.inward = [self._column(i) for i in range(n)]
        self.outward = [self._response(i, Z, N) for i in range(n)]
        self.found = {e.joint.child: self._found(e, N.slice(6 * e.joint.child, 6)) for e in stepping.elements if not e.joint.cut}
        joints = stepping.shares.joints if stepping.shares else []
        self.transmitted = {j.child: self._transmitted(j, N) for j in joints if not j.cut}
        self.moving: frozenset[int] = frozenset()
        self.passes: dict[frozenset[int], tuple[frozenset[int], array[int]]] = {}
        self.parents = [self.scene.parent(b) for b in range(n)]
        self.roots = self._roots()
        self.where = stepping.where()
        self.own: dict[str, Slot] = {}
        self.rubbing = {e.joint.name: e for e in stepping.elements}
        program.zero(self.effort)
        for column, row in enumerate(stepping.active):
            self._of_row(column, row)
        for e in stepping.elements:
            for k in range(e.joint.kind.nv):
                self._of_friction(e, k)

    def _force(self, i: int) -> Slot:
        """Slot of the force column on a body. The slot for the ground is not used."""
        return self.forces.slice(6 * (i if i != GROUND else len(self.system.bodies)), 6)

    def _column(self, i: int) -> array[int]:
        """Calls of body i in the inward reduction."""
        s, one, j = self.stepping, Program(), self.system.tree[i]
        self.scene.body_call(
            one, i, "column", work=s.moving[i].work, kept=s.kept[i], effort=free_of(self.effort, j), yc=free_of(self.y, j),
            fq=free_of(self.fq, j), fc=self._force(i), up=self._force(self.scene.parent(i)),
        )  # fmt: skip
        return one.code

    def _response(self, i: int, Z: Slot, N: Slot) -> array[int]:
        """Calls of body i in the outward pass."""
        s, one, j, parent = self.stepping, Program(), self.system.tree[i], self.scene.parent(i)
        before = self.scene.zeros if parent == GROUND else Z.slice(6 * parent, 6)
        self.scene.body_call(
            one, i, "response", work=s.moving[i].work, kept=s.kept[i], Z=before,
            yc=free_of(self.y, j), fc=self._force(i), qdd=free_of(self.qdd, j), Zo=Z.slice(6 * i, 6), N=N.slice(6 * i, 6),
        )  # fmt: skip
        return one.code

    def _found(self, e: Element, N: Slot) -> array[int]:
        """Calls that copy a joint's reaction components and accelerations into the slots of the current column."""
        one, j = Program(), e.joint
        self.stepping.pin(one, e, N, self.rows.slice(e.n0, len(e.needs)), whole=False)
        for f in j.free if self.maps.held else ():
            one.copy(free_of(self.qdd, j).slice(j.free.index(f), 1), self.held.slice(e.eta[0] + f, 1))
        return one.code

    def _transmitted(self, j: Joint, N: Slot) -> tuple[array[int], Slot]:
        """Calls that compute the wrench on a joint's outboard part; also the slot of this wrench."""
        one, ft = Program(), self.program.scratch_slot(6)
        self.scene.outboard_wrench(one, j, self.stepping.moving[j.child], N.slice(6 * j.child, 6), ft)
        return one.code, ft

    def _of_row(self, column: int, row: int) -> None:
        """Write one constraint row of a cut joint, and the generalised forces that a unit of its multiplier causes."""
        c = next(c for c in self.stepping.closed if c.joint.rows <= row < c.joint.rows + c.joint.kind.rows)
        k, program, m, nv = row - c.joint.rows, self.program, self.maps, self.system.nv
        self._empty()
        if c.joint.light:
            self._push(self.system.tree[c.joint.light.joint], c.joint.light.freedom, self.scene.constant([1.0]), column)
        else:
            for body, g in c.ends:
                program.call(Builtin.ADD, [c.row(g, k), self._force(body)], [6])
            self._move(list(c.joint.ends), column)
        program.copy(self.fq, self.pressed.slice(nv * column, nv))
        g0 = Slot(Space.MAPS, m.at("g0") + column, 1)
        program.copy(c.blocks["xi"].slice(k, 1), g0)
        every = 6 * (len(self.system.bodies) + 1)
        for pair, size in (((self.fq, self.stepping.y), nv), ((self.forces, self.scene.all_bias), every)):
            program.call(Builtin.ADD_DOT, [*pair, g0], [size, 1])
        own = Slot(Space.MAPS, m.at("S") + m.active * column, column + 1)
        self._constrain(own, column + 1)
        if c.joint.light:
            program.call(Builtin.ADD, [self.scene.constant([c.joint.light.response]), own.slice(column, 1)], [1])
        for other in range(column):
            program.copy(own.slice(other, 1), Slot(Space.MAPS, m.at("S") + m.active * other + column, 1))
        e = self.rubbing.get(c.joint.name)
        if e:
            self.stepping.pin_of_cut(program, e, c.row("gat", k), self.rows.slice(e.n0, len(e.needs)), whole=False)
        self.own = {} if self.scene.bare or c.joint.mimic or c.joint.light else {c.joint.name: c.row("gat", k)}
        self._keep(column)

    def _of_friction(self, e: Element, k: int) -> None:
        """Write the column of friction along freedom k of a joint. If the freedom is prescribed, the column is 0."""
        program, m, j = self.program, self.maps, e.joint
        column = m.active + e.eta[0] + k
        self._empty()
        if j.cut:
            c = self.stepping.closing(j)
            for body, w in ((j.inb, "win"), (j.out, "wout")):
                program.call(Builtin.ADD_COLUMNS, [c.row(w, k), self.scene.against, self._force(body)], [6, 1])
            self._move([j.inb, j.out], column)
            own = program.scratch_slot(6)
            program.zero(own)
            program.call(Builtin.ADD_COLUMNS, [c.row("wat", k), self.scene.against, own], [6, 1])
            self.stepping.pin_of_cut(program, e, own, self.rows.slice(e.n0, len(e.needs)), whole=False)
            self.own = {j.name: own}
        elif k in j.free:
            self._push(j, k, self.scene.against, column)
        if m.active:
            self._constrain(Slot(Space.MAPS, m.at("Se") + m.active * (e.eta[0] + k), m.active), m.active)
        self._keep(column)

    def _push(self, j: Joint, k: int, force: Slot, column: int) -> None:
        """Apply a force along freedom k of a tree joint."""
        own = free_of(self.effort, j).slice(j.free.index(k), 1)
        self.program.copy(force, own)
        self._move([j.child], column)
        self.program.zero(own)

    def _empty(self) -> None:
        """Set the slots of the current column to zero."""
        self.own, self.moving = {}, frozenset()
        for block in (self.y, self.fq, self.forces, self.rows, *([self.held] if self.maps.held else [])):
            self.program.zero(block)

    def _move(self, begin: list[int], column: int) -> None:
        """Write the inward pass from the bodies on which the force acts. Then write the outward pass over all bodies that move."""
        program = self.program
        for i in self._path(begin):
            program.code += self.inward[i]
        roots = frozenset(self.roots[i] for i in begin if i != GROUND)
        if roots not in self.passes:
            branch = [b for b, root in enumerate(self.roots) if root in roots]
            self.passes[roots] = frozenset(branch), self._outward(branch)
        self.moving, outward = self.passes[roots]
        program.code += outward
        for e in self.stepping.elements if self.maps.held else []:
            if e.joint.cut and not self.moving.isdisjoint((e.joint.inb, e.joint.out)):
                Z = [self.Z.slice(6 * b, 6) if b in self.moving else self.scene.zeros for b in (e.joint.inb, e.joint.out)]
                self.stepping.along_cut(program, self.stepping.closing(e.joint), Z, self.held.slice(e.eta[0], e.joint.kind.nv))

    def _constrain(self, out: Slot, count: int) -> None:
        """Write the products of the column with the first ``count`` rows of the constraint equations."""
        nv = self.system.nv
        self.program.zero(out)
        self.program.call(Builtin.ADD_ROW_DOTS, [self.pressed, self.y, out], [nv, count, nv, 1])

    def _keep(self, column: int) -> None:
        """Copy the results into the maps."""
        nv = self.system.nv
        self.program.copy(self.y, self.block.slice(nv * column, nv))
        self.program.copy(self.rows, self.maps.N(column))
        if self.maps.held:
            self.program.copy(self.held, self.maps.Q(column))
        if self.stepping.shares:
            self.stepping.shares.write(self.program, self.where, self.stepping.moving, self._shared, self.maps.kappa(column))

    def _shared(self, j: Joint) -> Slot | None:
        """Wrench that a joint transmits in the present column; None means zero."""
        if j.cut:
            return self.own.get(j.name)
        return self.transmitted[j.child][1] if j.child in self.moving else None

    def _outward(self, branch: list[int]) -> array[int]:
        """Calls of the outward pass over these bodies, and of what it leaves in the slots of the column."""
        out = array("i")
        for i in branch if self.stepping.asked else ():
            out += self.outward[i]
        for i in branch:
            out += self.found.get(i, array("i"))
            out += self.transmitted[i][0] if i in self.transmitted else array("i")
        return out

    def _path(self, begin: list[int]) -> list[int]:
        """Bodies on the paths from ``begin`` to the ground, outermost first."""
        path: set[int] = set()
        for i in begin:
            while i != GROUND:
                path.add(i)
                i = self.parents[i]
        return sorted(path, reverse=True)

    def _roots(self) -> list[int]:
        """For each body, the body of its branch that a joint connects to the ground. All bodies of a branch move together."""
        roots: list[int] = []
        for b, parent in enumerate(self.parents):
            roots.append(b if parent == GROUND else roots[parent])
        return roots
