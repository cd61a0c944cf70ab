"""The columns of the affine maps of a tree: each friction multiplier's force inward along the path of its joint, and the
accelerations and reactions it causes outward over the branch.

What is called for a body is the same for every column, and is written once: a column works on numbers that all columns share, and
what it found is copied to its place at its end."""

from __future__ import annotations

from typing import TYPE_CHECKING

from engine.parts.tape import Block, Space, Tape
from engine.recursion.elements import Element
from engine.system.structure import GROUND

if TYPE_CHECKING:
    from engine.parts.stepping import Stepping


class Columns:
    """Writes the columns behind a tape. block: where accelerations of all columns are kept for stage 2 (nv each)."""

    def __init__(self, stepping: Stepping, tape: Tape, block: Block):
        self.stepping, self.tape, self.block = stepping, tape, block
        self.scene, self.system, self.maps = stepping.scene, stepping.system, stepping.maps
        n, nv = len(self.system.bodies), self.system.nv
        self.y, self.effort, self.qdd = (tape.scratch_block(nv) for _ in range(3))
        self.forces = tape.scratch_block(6 * (n + 1))
        self.rows, self.held = tape.scratch_block(self.maps.nn), tape.scratch_block(self.maps.ne)
        Z, N = tape.scratch_block(6 * n), tape.scratch_block(6 * n)
        self.inward = [self._column(i) for i in range(n)]
        self.outward = [self._response(i, Z, N) for i in range(n)]
        self.found = {e.joint.child: self._found(e, N.part(6 * e.joint.child, 6)) for e in stepping.parts}
        tape.zero(self.effort)
        for e in stepping.parts:
            for k in range(e.joint.kind.nv):
                self._write(e, k)

    def _force(self, i: int) -> Block:
        """Force column on a body; on the ground it comes to nothing."""
        return self.forces.part(6 * (i if i != GROUND else len(self.system.bodies)), 6)

    def _column(self, i: int) -> list[int]:
        """Calls for body i on the way inward."""
        s, one, j = self.stepping, Tape(), self.system.tree[i]
        self.scene.body_call(
            one, i, "column", work=s.moving[i].work, kept=s.kept[i], effort=s.own(self.effort, j), yc=s.own(self.y, j),
            fc=self._force(i), up=self._force(self.scene.parent(i)),
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
        self.stepping.pin(one, e, N, self.rows.part(e.n0, len(e.needs)))
        for f in j.free if self.maps.held else ():
            one.copy(self.stepping.own(self.qdd, j).part(j.free.index(f), 1), self.held.part(e.eta[0] + f, 1))
        return one.code

    def _write(self, e: Element, k: int) -> None:
        """The column of friction along freedom k of a joint, which is 0 where that is prescribed."""
        tape, m, j, at, nv = self.tape, self.maps, e.joint, e.eta[0] + k, self.system.nv
        for block in (self.y, self.forces, self.rows, *([self.held] if m.held else [])):
            tape.zero(block)
        if k in j.free:
            own = self.stepping.own(self.effort, j).part(j.free.index(k), 1)
            path, branch = self._way(j.child)
            tape.copy(self.scene.against, own)
            for i in path:
                tape.code += self.inward[i]
            for i in branch:
                tape.code += self.outward[i]
            for i in branch:
                tape.code += self.found.get(i, [])
            tape.zero(own)
        tape.copy(self.y, self.block.part(nv * at, nv))
        tape.copy(self.rows, Block(Space.MAPS, m.nn * (1 + at), m.nn))
        if m.held:
            tape.copy(self.held, Block(Space.MAPS, m.rates + m.nrates + m.ne * (1 + at), m.ne))

    def _way(self, i: int) -> tuple[list[int], list[int]]:
        """Bodies from i to the ground, and all that move with the last of them."""
        path = [i]
        while self.scene.parent(path[-1]) != GROUND:
            path.append(self.scene.parent(path[-1]))
        inside = {path[-1]}
        for b in range(len(self.system.bodies)):
            if self.scene.parent(b) in inside:
                inside.add(b)
        return path, sorted(inside)
