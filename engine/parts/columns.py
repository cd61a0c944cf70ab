"""The columns of the affine maps: each multiplier's force inward along the path of its joint, and the accelerations and reactions
it causes outward over the branch; the constraint equations of cut joints on the way.

What is called for a body is the same for every column, and is written once: a column works on numbers that all columns share, and
what it found is copied to its place at its end."""

from __future__ import annotations

from typing import TYPE_CHECKING

from engine.parts.store import closing
from engine.parts.tape import Block, Builtin, Space, Tape
from engine.system.elements import Element
from engine.system.structure import GROUND, Joint

if TYPE_CHECKING:
    from engine.parts.stepping import Stepping


class Columns:
    """Writes the columns behind a tape. block: where accelerations of all columns are kept for stage 2 (nv each)."""

    def __init__(self, stepping: Stepping, tape: Tape, block: Block):
        self.stepping, self.tape, self.block = stepping, tape, block
        self.scene, self.system, self.maps = stepping.scene, stepping.system, stepping.maps
        n, nv = len(self.system.bodies), self.system.nv
        self.y, self.effort, self.qdd, self.fq = (tape.scratch_block(nv) for _ in range(4))
        self.pressed = tape.scratch_block(nv * self.maps.active)
        self.forces = tape.scratch_block(6 * (n + 1))
        self.rows, self.held = tape.scratch_block(self.maps.nn), tape.scratch_block(self.maps.ne)
        Z, N = tape.scratch_block(6 * n), tape.scratch_block(6 * n)
        self.Z = Z
        self.inward = [self._column(i) for i in range(n)]
        self.outward = [self._response(i, Z, N) for i in range(n)]
        self.found = {e.joint.child: self._found(e, N.part(6 * e.joint.child, 6)) for e in stepping.parts if not e.joint.cut}
        joints = stepping.shares.joints if stepping.shares else []
        self.transmitted = {j.child: self._transmitted(j, N) for j in joints if not j.cut}
        self.branch: list[int] = []
        self.where = stepping.where()
        self.own: dict[str, Block] = {}
        self.rubbing = {e.joint.name: e for e in stepping.parts}
        tape.zero(self.effort)
        for column, row in enumerate(stepping.active):
            self._of_row(column, row)
        for e in stepping.parts:
            for k in range(e.joint.kind.nv):
                self._of_friction(e, k)

    def _force(self, i: int) -> Block:
        """Force column on a body; on the ground it comes to nothing."""
        return self.forces.part(6 * (i if i != GROUND else len(self.system.bodies)), 6)

    def _column(self, i: int) -> list[int]:
        """Calls for body i on the way inward."""
        s, one, j = self.stepping, Tape(), self.system.tree[i]
        self.scene.body_call(
            one, i, "column", work=s.moving[i].work, kept=s.kept[i], effort=s.own(self.effort, j), yc=s.own(self.y, j),
            fq=s.own(self.fq, j), fc=self._force(i), up=self._force(self.scene.parent(i)),
        )  # fmt: skip
        return one.code

    def _response(self, i: int, Z: Block, N: Block) -> list[int]:
        """Calls for body i on the way outward."""
        s, one, j, parent = self.stepping, Tape(), self.system.tree[i], self.scene.parent(i)
        before = self.scene.zeros if parent == GROUND else Z.part(6 * parent, 6)
        self.scene.body_call(
            one, i, "response", work=s.moving[i].work, kept=s.kept[i], Z=before,
            yc=s.own(self.y, j), fc=self._force(i), qdd=s.own(self.qdd, j), Zo=Z.part(6 * i, 6), N=N.part(6 * i, 6),
        )  # fmt: skip
        return one.code

    def _found(self, e: Element, N: Block) -> list[int]:
        """Calls by which a joint's reaction components and accelerations are put among those of the column."""
        one, j = Tape(), e.joint
        self.stepping.pin(one, e, N, self.rows.part(e.n0, len(e.needs)), whole=False)
        for f in j.free if self.maps.held else ():
            one.copy(self.stepping.own(self.qdd, j).part(j.free.index(f), 1), self.held.part(e.eta[0] + f, 1))
        return one.code

    def _transmitted(self, j: Joint, N: Block) -> tuple[list[int], Block]:
        """Calls by which what a joint transmits to its outboard part is found, and where it then is."""
        one, ft = Tape(), self.tape.scratch_block(6)
        part, pose = closing.outboard(j.forward), self.stepping.moving[j.child].pose
        self.scene.call(one, part, N=N.part(6 * j.child, 6), pose=pose, out=ft)
        return one.code, ft

    def _of_row(self, column: int, row: int) -> None:
        """The column of the multiplier of a row of a cut joint, and its own row of the constraint equations."""
        c = next(c for c in self.stepping.closed if c.joint.rows <= row < c.joint.rows + c.joint.kind.rows)
        k, tape, m, nv = row - c.joint.rows, self.tape, self.maps, self.system.nv
        self._empty()
        for body, g in c.ends:
            tape.call(Builtin.ADD, [c.row(g, k), self._force(body)], [6])
        self._move(list(c.joint.ends), column)
        tape.copy(self.fq, self.pressed.part(nv * column, nv))
        g0 = Block(Space.MAPS, m.at("g0") + column, 1)
        tape.copy(c.blocks["xi"].part(k, 1), g0)
        every = 6 * (len(self.system.bodies) + 1)
        for pair, size in (((self.fq, self.stepping.y), nv), ((self.forces, self.scene.all_bias), every)):
            tape.call(Builtin.PRODUCT, [*pair, g0], [size, 1])
        own = Block(Space.MAPS, m.at("S") + m.active * column, column + 1)
        self._constrain(own, column + 1)
        for other in range(column):
            tape.copy(own.part(other, 1), Block(Space.MAPS, m.at("S") + m.active * other + column, 1))
        e = self.rubbing.get(c.joint.name)
        if e:
            self.stepping.pin_of_cut(tape, e, c.row("gat", k), self.rows.part(e.n0, len(e.needs)), whole=False)
        self.own = {} if c.joint.mimic else {c.joint.name: c.row("gat", k)}
        self._keep(column)

    def _of_friction(self, e: Element, k: int) -> None:
        """The column of friction along freedom k of a joint, which is 0 where that is prescribed."""
        tape, m, j = self.tape, self.maps, e.joint
        column = m.active + e.eta[0] + k
        self._empty()
        if j.cut:
            c = self.stepping.closing(j)
            for body, w in ((j.inb, "win"), (j.out, "wout")):
                tape.call(Builtin.ALONG, [c.row(w, k), self.scene.against, self._force(body)], [6, 1])
            self._move([j.inb, j.out], column)
            own = tape.scratch_block(6)
            tape.zero(own)
            tape.call(Builtin.ALONG, [c.row("wat", k), self.scene.against, own], [6, 1])
            self.stepping.pin_of_cut(tape, e, own, self.rows.part(e.n0, len(e.needs)), whole=False)
            self.own = {j.name: own}
        elif k in j.free:
            own = self.stepping.own(self.effort, j).part(j.free.index(k), 1)
            tape.copy(self.scene.against, own)
            self._move([j.child], column)
            tape.zero(own)
        if m.active:
            self._constrain(Block(Space.MAPS, m.at("Se") + m.active * (e.eta[0] + k), m.active), m.active)
        self._keep(column)

    def _empty(self) -> None:
        """Nothing acts, nothing is found yet."""
        self.own, self.branch = {}, []
        for block in (self.y, self.fq, self.forces, self.rows, *([self.held] if self.maps.held else [])):
            self.tape.zero(block)

    def _move(self, begin: list[int], column: int) -> None:
        """Inward from the bodies that are acted on, outward over all that moves; what friction needs is found."""
        tape = self.tape
        path, branch = self._way(begin)
        for i in path:
            tape.code += self.inward[i]
        for i in branch if self.stepping.asked else ():
            tape.code += self.outward[i]
        for i in branch:
            tape.code += self.found.get(i, [])
            tape.code += self.transmitted[i][0] if i in self.transmitted else []
        self.branch, moving = branch, set(branch)
        for e in self.stepping.parts if self.maps.held else []:
            if e.joint.cut and (e.joint.inb in moving or e.joint.out in moving):
                Z = [self.Z.part(6 * b, 6) if b in moving else self.scene.zeros for b in (e.joint.inb, e.joint.out)]
                self.stepping.along_cut(tape, self.stepping.closing(e.joint), Z, self.held.part(e.eta[0], e.joint.kind.nv))

    def _constrain(self, out: Block, count: int) -> None:
        """What the column does to the first rows of the constraint equations."""
        nv = self.system.nv
        self.tape.zero(out)
        self.tape.call(Builtin.DOTS, [self.pressed, self.y, out], [nv, count, nv, 1])

    def _keep(self, column: int) -> None:
        """Put what was found in its place."""
        nv = self.system.nv
        self.tape.copy(self.y, self.block.part(nv * column, nv))
        self.tape.copy(self.rows, self.maps.N(column))
        if self.maps.held:
            self.tape.copy(self.held, self.maps.Q(column))
        if self.stepping.shares:
            self.stepping.shares.write(self.tape, self.where, self.stepping.moving, self._shared, self.maps.kappa(column))

    def _shared(self, j: Joint) -> Block | None:
        """What a joint transmits in the column."""
        if j.cut:
            return self.own.get(j.name)
        return self.transmitted[j.child][1] if j.child in self.branch else None

    def _way(self, begin: list[int]) -> tuple[list[int], list[int]]:
        """Bodies from those given to the ground, outermost first, and all that move with the last of them."""
        path: set[int] = set()
        for i in begin:
            while i != GROUND:
                path.add(i)
                i = self.scene.parent(i)
        inside = {i for i in path if self.scene.parent(i) == GROUND}
        for b in range(len(self.system.bodies)):
            if self.scene.parent(b) in inside:
                inside.add(b)
        return sorted(path, reverse=True), sorted(inside)
