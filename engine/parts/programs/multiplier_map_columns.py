"""Columns of the affine maps: accelerations and reactions under a unit of each multiplier. The unit force of each multiplier is
reduced inward, from its joint to the ground. An outward pass over the branch then computes accelerations and reactions.

All columns use the same calls for a body, in shared scratch. The program ``shared`` contains these calls once; each column executes
the ranges for its bodies. The results are then copied into the maps."""

from __future__ import annotations

from trunnion.parts.bytecode.body_and_joint_slots import free_of
from trunnion.parts.bytecode.program import Builtin, Program, Slot, Space
from trunnion.parts.programs.evaluation_passes import EvaluationPasses
from trunnion.system.structure.bodies_and_joints import GROUND, Joint
from trunnion.system.structure.friction_joint_indices import Element


class ForceColumns:
    """Writes calls that compute the maps from a unit of each multiplier. block: slot of the accelerations (nv for each multiplier)
    that these units cause; stage 2 reads it."""

    def __init__(self, stepping: EvaluationPasses, program: Program, block: Slot):
        self.stepping, self.program, self.block = stepping, program, block
        self.scene, self.system, self.maps = stepping.scene, stepping.system, stepping.maps
        n, nv = len(self.system.bodies), self.system.nv
        self.qdd, self.pressed = program.scratch_slot(nv), program.scratch_slot(nv * self.maps.active)
        # the next slots are adjacent, so that one call sets them to zero
        self.effort, self.y, self.fq = (program.scratch_slot(nv) for _ in range(3))
        self.forces = program.scratch_slot(6 * (n + 1))
        self.rows, self.held = program.scratch_slot(self.maps.nn), program.scratch_slot(self.maps.ne)
        self.Z, self.N = program.scratch_slot(6 * n), program.scratch_slot(6 * n)
        self.shared = self.scene.program("shared")
        self.shared.in_ranges = True
        self.inward = self._inward()
        self.elements = {e.joint.child: e for e in stepping.elements if not e.joint.cut}
        joints = stepping.shares.joints if stepping.shares else []
        self.transmitted = {j.child: program.scratch_slot(6) for j in joints if not j.cut}
        self.moving: set[int] = set()
        """Roots of the branches that the present column moves."""
        self.parents = [self.scene.parent(b) for b in range(n)]
        self.roots, self.first = self._roots(), self._first()
        branches: dict[int, list[int]] = {}
        for b, root in enumerate(self.roots):
            branches.setdefault(root, []).append(b)
        self.outward = {root: self._outward(branch) for root, branch in branches.items()}
        self.held_cuts = [e for e in stepping.elements if e.joint.cut] if self.maps.held else []
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

    def _inward(self) -> list[int]:
        """Write the inward reduction of all bodies, outermost first. Returns positions in the program: the calls of body i start at
        entry i + 1 and end at entry i."""
        s, ends = self.stepping, [len(self.shared.code)]
        for i, j in reversed(list(enumerate(self.system.tree))):
            self.scene.body_call(
                self.shared, i, "column", work=s.moving[i].work, kept=s.kept[i], effort=free_of(self.effort, j),
                yc=free_of(self.y, j), fq=free_of(self.fq, j), fc=self._force(i), up=self._force(self.scene.parent(i)),
            )  # fmt: skip
            ends.append(len(self.shared.code))
        return ends[::-1]

    def _outward(self, branch: list[int]) -> tuple[int, int]:
        """Write the outward pass over the bodies of a branch, and the calls that fill the slots of the column with the results of
        the pass. Returns the start and the length of all these calls."""
        s, one, start = self.stepping, Program(), len(self.shared.code)
        for i in branch if s.asked else ():
            j, parent = self.system.tree[i], self.parents[i]
            before = self.scene.zeros if parent == GROUND else self.Z.slice(6 * parent, 6)
            self.scene.body_call(
                one, i, "response", work=s.moving[i].work, kept=s.kept[i], Z=before, yc=free_of(self.y, j), fc=self._force(i),
                qdd=free_of(self.qdd, j), Zo=self.Z.slice(6 * i, 6), N=self.N.slice(6 * i, 6),
            )  # fmt: skip
        for i in branch:
            N, j = self.N.slice(6 * i, 6), self.system.tree[i]
            if i in self.elements:
                self._found(one, self.elements[i], N)
            if i in self.transmitted:
                self.scene.outboard_wrench(one, j, s.moving[i], N, self.transmitted[i])
        self.shared.code.extend(one.merged())
        return start, len(self.shared.code) - start

    def _found(self, program: Program, e: Element, N: Slot) -> None:
        """Copy a joint's reaction components and accelerations into the slots of the current column."""
        j = e.joint
        self.stepping.pin(program, e, N, self.rows.slice(e.n0, len(e.needs)), whole=False)
        for f in j.free if self.maps.held else ():
            program.copy(free_of(self.qdd, j).slice(j.free.index(f), 1), self.held.slice(e.eta[0] + f, 1))

    def _execute(self, ranges: list[tuple[int, int]]) -> None:
        """Write calls that execute ranges of the program ``shared``, each given by start and length. Adjacent ranges become one
        call."""
        joined: list[tuple[int, int]] = []
        for start, length in ranges:
            if joined and sum(joined[-1]) == start:
                joined[-1] = joined[-1][0], joined[-1][1] + length
            elif length:
                joined.append((start, length))
        slots = [Slot(space, 0, 0) for space in (Space.C, Space.X, Space.Y, Space.W, Space.MAPS, Space.T)]
        for start, length in joined:
            self.program.call(Builtin.SHARED, slots, [start, length])

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
        self.own = {} if self.scene.bare or "gat" not in c.blocks else {c.joint.name: c.row("gat", k)}
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
        self.own, self.moving = {}, set()
        for block in (self.y, self.fq, self.forces, self.rows, *([self.held] if self.maps.held else [])):
            self.program.zero(block)

    def _move(self, begin: list[int], column: int) -> None:
        """Write the inward pass from the bodies on which the force acts. Then write the outward pass over all bodies that move."""
        program = self.program
        self.moving = {self.roots[i] for i in begin if i != GROUND}
        runs = [(self.inward[last + 1], self.inward[first] - self.inward[last + 1]) for last, first in self._runs(begin)]
        self._execute([*runs, *(self.outward[root] for root in sorted(self.moving))])
        for e in self.held_cuts:
            ends = e.joint.inb, e.joint.out
            if any(map(self._moves, ends)):
                Z = [self.Z.slice(6 * b, 6) if self._moves(b) else self.scene.zeros for b in ends]
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
        """Wrench that a joint transmits in the present column; None: zero."""
        if j.cut:
            return self.own.get(j.name)
        return self.transmitted[j.child] if self._moves(j.child) else None

    def _moves(self, b: int) -> bool:
        """Whether the present column moves a body."""
        return b != GROUND and self.roots[b] in self.moving

    def _runs(self, begin: list[int]) -> list[tuple[int, int]]:
        """Last and first body of each run of successive bodies on the paths from ``begin`` to the ground, outermost first."""
        outer, runs = set(begin) - {GROUND}, []
        while outer:
            last = max(outer)
            first = self.first[last]
            runs.append((last, first))
            outer = {i for i in (*outer, self.parents[first]) if GROUND < i < first}
        return runs

    def _first(self) -> list[int]:
        """For each body, the first body of its run. In a run, each body is the inboard body of the next body."""
        first: list[int] = []
        for b, parent in enumerate(self.parents):
            first.append(first[parent] if GROUND < parent == b - 1 else b)
        return first

    def _roots(self) -> list[int]:
        """For each body, the root of its branch: the body that a joint connects to the ground. A force on one body of a branch
        moves all bodies of the branch."""
        roots: list[int] = []
        for b, parent in enumerate(self.parents):
            roots.append(b if parent == GROUND else roots[parent])
        return roots
