"""Friction of many loops along the recursion: what the multipliers of cut joints add to tapes of friction (``recursive``), each
loop's followed along its own path (METHOD, "Friction along the recursion").

Where joints rub, the response to a multiplier and what its row asks of accelerations are no transposes of each other: there are
force columns and rows, and S is not symmetric. A cut joint's own friction is local: it changes the columns of its multipliers."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

from engine.parts.blocks import Closed
from engine.parts.looping import Loop, Rubs
from engine.parts.tape import Block, Builtin, Space, Tape
from engine.system.coupling import fill, path, rows_by_loop
from engine.system.structure import GROUND

if TYPE_CHECKING:
    from engine.parts.recursive import Recursive


class Coupled:
    """The loops of a scene whose friction is found along the recursion."""

    def __init__(self, recursive: Recursive):
        self.recursive, self.stepping = recursive, recursive.stepping
        self.scene, self.system, self.active = self.stepping.scene, self.stepping.system, len(self.stepping.active)
        room, a = self.stepping.w_block, self.active
        self.free = [len(j.free) for j in self.system.tree]
        self.S, self.low, self.high = room(a * a), room(a * a), room(a * a)
        self.gap, self.lam, self.more = room(a), room(a), room(a)
        f = fill(self.system, self.stepping.active, 1.0)
        self.refines = not fill(self.system, self.stepping.active).below
        self.listed = [a, *f.order, *f.start, *f.below]
        self.rubbing = {e.joint.name: e for e in self.stepping.parts if e.joint.cut}
        found = rows_by_loop(self.system, self.stepping.active)
        self.loops: list[Loop] = [self._loop(self.stepping.closing(c), rows) for c, rows in found]
        self.pivots = Block(Space.OUT, len(self.system.bodies), len(self.stepping.parts) + a)

    # -- what there is ------------------------------------------------------------------------------------------------------

    def _loop(self, c: Closed, rows: list[int]) -> Loop:
        at, size, room, n = {}, 0, self.stepping.w_block, len(rows)
        for i in path(self.system, c.joint):
            at[i] = size
            size += self.free[i]
        each = 6 * (len(at) + 1)
        own = [self.stepping.active[r] - c.joint.rows for r in rows]
        of = {i: (self.system.tree[i].v0, self.free[i]) for i in at}
        made = Loop(c, rows, own, at, of, room(size * n), room(size * n), room(each * n), room(each * n))
        e = self.rubbing.get(c.joint.name)
        if e:
            nv, needs = c.joint.kind.nv, len(e.needs)
            sizes = (needs * n, needs * nv, needs, nv * nv, nv * n, nv, nv)
            made.rubs = Rubs(e, *(room(size) for size in sizes))
        return made

    def begin(self, tape: Tape) -> None:
        """Reactions of cut joints that rub, by what makes them up."""
        for loop in self.loops:
            r, c = loop.rubs, loop.closed
            if not r:
                continue
            needs, pin = len(r.element.needs), self.stepping.pin_of_cut
            for k, row in enumerate(loop.own):
                pin(tape, r.element, c.row("gat", row), r.by_rows.part(needs * k, needs), False)
            for k in range(c.joint.kind.nv):
                pin(tape, r.element, c.row("wat", k), r.by_friction.part(needs * k, needs), False)
            pin(tape, r.element, self.stepping.transmitted(tape, c.joint, []), r.p0)

    # -- with the laws' derivatives -----------------------------------------------------------------------------------------

    def narrow(self, tape: Tape) -> None:
        """Columns, rows and the factor of S; pivots behind those of the bodies: of each element, of S."""
        count, dn, at = len(self.stepping.parts), {}, 0
        tape.copy(self.scene.constant([1.0] * count), self.pivots)
        for e in self.stepping.parts:
            dn[e.joint.name] = Block(Space.DN, at, e.joint.kind.nv * len(e.needs))
            at += dn[e.joint.name].size
        for number, loop in enumerate(self.loops):
            self._wrenches(tape, loop, dn)
            for k in range(len(loop.rows)):
                self._column(tape, loop, k)
            for other in self.loops[: number + 1]:
                loop.meet(tape, other, self.S, self.active)
        own = self.pivots.part(count, self.active)
        tape.call(Builtin.FACTOR, [self.S, self.low, self.high, own], self.listed)

    def _wrenches(self, tape: Tape, loop: Loop, dn: dict[str, Block]) -> None:
        """Columns and rows as they begin on the two bodies: the same but for the friction that the cut joint itself makes."""
        c, j, r = loop.closed, loop.closed.joint, loop.rubs
        how = [loop.each, loop.places[j.inb], loop.places[j.out], len(loop.own), *loop.own]
        for out in (loop.pressed, loop.sensed):
            tape.call(Builtin.WRENCHES, [c.blocks["gin"], c.blocks["gout"], out], how)
            for (body, g), (k, row) in product(c.ends[2:], enumerate(loop.own)):
                tape.call(Builtin.ADD, [c.row(g, row), loop.on(out, body, k)], [6])
        if not r:
            return
        nv, n = j.kind.nv, len(loop.own)
        det = self.pivots.part(self.stepping.parts.index(r.element), 1)
        places = [dn[j.name], r.by_friction, r.by_rows, r.p0, r.inverse, r.turned, r.less, det]
        tape.call(Builtin.GRIP, places, [nv, len(r.element.needs), n])
        for k in range(n):
            for body, w in ((j.inb, "win"), (j.out, "wout")):
                tape.call(Builtin.ALONG, [c.blocks[w], r.turned.part(nv * k, nv), loop.on(loop.pressed, body, k)], [6, nv])

    def _column(self, tape: Tape, loop: Loop, k: int) -> None:
        """Column and row k inward from the bodies that are acted on."""
        for i in reversed(loop.at):
            parent = self.scene.parent(i)
            y, along = (b.part(loop.size * k + loop.at[i], self.free[i]) for b in (loop.y, loop.along))
            self._call(tape, i, "press", fc=loop.on(loop.pressed, i, k), yc=y, up=loop.on(loop.pressed, parent, k))
            self._call(tape, i, "sense", fc=loop.on(loop.sensed, i, k), fq=along, up=loop.on(loop.sensed, parent, k))

    def _call(self, tape: Tape, i: int, name: str, **places: Block) -> None:
        self.scene.body_call(tape, i, name, work=self.stepping.moving[i].work, slim=self.recursive.slim[i], **places)

    # -- an answer ----------------------------------------------------------------------------------------------------------

    def forces(self, tape: Tape) -> list[Block]:
        """What acts on each body, with the known part of the cut joints' friction."""
        found = [m.force for m in self.stepping.moving]
        for loop in self.loops:
            r = loop.rubs
            if r:
                nv = loop.closed.joint.kind.nv
                tape.copy(r.less, r.eta)
                tape.call(Builtin.SPREAD, [r.inverse, Block(Space.U, min(r.element.eta), nv), r.eta], [nv, nv, nv])
                self._act(tape, loop.closed, r.eta, found)
        return found

    def _act(self, tape: Tape, c: Closed, less: Block, found: list[Block]) -> None:
        """Add to what acts on the bodies that a cut joint joins its friction −η (``less``)."""
        for body, w in ((c.joint.inb, "win"), (c.joint.out, "wout")):
            if body != GROUND:
                tape.call(Builtin.ALONG, [c.blocks[w], less, self._own(tape, found, body)], [6, c.joint.kind.nv])

    def _own(self, tape: Tape, found: list[Block], i: int) -> Block:
        """What acts on a body, in a place of its own."""
        if found[i] is self.stepping.moving[i].force:
            found[i] = tape.scratch_block(6)
            tape.copy(self.stepping.moving[i].force.part(0, 6), found[i])
        return found[i]

    def solve(self, tape: Tape) -> None:
        """λ from S λ + g = 0, g by the accelerations y that there are without; y and F with them."""
        s, base = self.recursive, len(self.system.bodies)
        for loop in self.loops:
            n, g = len(loop.rows), loop.of(self.gap)
            tape.call(Builtin.PICK, [loop.closed.blocks["xi"], g], [n, *loop.own])
            for first, count, free in [*loop.runs(), (GROUND, 1, 0)]:
                at = 6 * (base if first == GROUND else first)
                bias = [loop.on(loop.sensed, first, 0), self.scene.all_bias.part(at, 6 * count), g]
                tape.call(Builtin.GRAM, bias, [6 * count, n, loop.each])
                if free:
                    known = s.y.part(self.system.tree[first].v0, free)
                    tape.call(Builtin.GRAM, [loop.along.part(loop.at[first], free), known, g], [free, n, loop.size])
        tape.call(Builtin.SOLVE, [self.low, self.high, self.gap, self.lam], self.listed)
        self._add(tape, self.lam)

    def again(self, tape: Tape, Z: list[Block]) -> bool:
        """Where all loops meet (a ladder, whose S has a condition of 1e8 at a hundred rungs) what these accelerations leave of
        their rows is taken by multipliers once more. Whether it is so."""
        if self.refines:
            self._left(tape, self.gap, Z)
            tape.call(Builtin.SOLVE, [self.low, self.high, self.gap, self.more], self.listed)
            self._add(tape, self.more)
            tape.call(Builtin.ADD, [self.more, self.lam], [self.active])
        return self.refines

    def _add(self, tape: Tape, lam: Block) -> None:
        """Add to y and F what these multipliers do."""
        s = self.recursive
        for loop in self.loops:
            loop.respond(tape, lam, s.y)
            for first, count, _ in loop.runs():
                tape.call(Builtin.SPREAD, [loop.on(loop.pressed, first, 0), loop.of(lam), s.F[first]],
                          [6 * count, len(loop.rows), loop.each])  # fmt: skip

    def found(self, tape: Tape, Z: list[Block]) -> None:
        """λ, reaction components and accelerations of cut joints that rub."""
        tape.copy(self.lam, Block(Space.OUT, self.system.neta, self.active))
        for loop in self.loops:
            if loop.rubs:
                nv, first, lam = loop.closed.joint.kind.nv, min(loop.rubs.element.eta), loop.of(self.lam)
                tape.call(Builtin.SPREAD, [loop.rubs.turned, lam, loop.rubs.eta], [nv, len(loop.rows), nv])
                tape.zero(Block(Space.OUT, first, nv))
                self._told(tape, loop, lam, loop.rubs.eta, Z)

    def _told(self, tape: Tape, loop: Loop, lam: Block, less: Block, Z: list[Block]) -> None:
        """The same with these multipliers and −η."""
        r, c = loop.rubs, loop.closed
        assert r is not None
        nv, needs, first = c.joint.kind.nv, len(r.element.needs), min(r.element.eta)
        out, acceleration = Block(Space.N, r.element.n0, needs), Block(Space.A, first, nv)
        tape.copy(r.p0, out)
        tape.call(Builtin.SPREAD, [r.by_rows, lam, out], [needs, len(loop.rows), needs])
        tape.call(Builtin.SPREAD, [r.by_friction, less, out], [needs, nv, needs])
        tape.copy(c.blocks["bias"], acceleration)
        self.stepping.along_cut(tape, c, self._ends(c, Z), acceleration)

    def _ends(self, c: Closed, Z: list[Block]) -> list[Block]:
        return [Z[b] if b != GROUND else self.scene.base for b in (c.joint.inb, c.joint.out)]

    # -- beside it ----------------------------------------------------------------------------------------------------------

    def given(self, tape: Tape) -> list[Block]:
        """What acts on each body with multipliers λ and frictions −η that are given."""
        found = [m.force for m in self.stepping.moving]
        for loop in self.loops:
            c, j, lam = loop.closed, loop.closed.joint, self._given(loop)
            for body, g in c.ends:
                for k, row in enumerate(loop.own) if body != GROUND else ():
                    tape.call(Builtin.ALONG, [c.row(g, row), lam.part(k, 1), self._own(tape, found, body)], [6, 1])
            if loop.rubs:
                self._act(tape, c, Block(Space.U, min(loop.rubs.element.eta), j.kind.nv), found)
        return found

    def _given(self, loop: Loop) -> Block:
        return Block(Space.U, self.system.neta + loop.rows[0], len(loop.rows))

    def gaps(self, tape: Tape, Z: list[Block]) -> None:
        """With accelerations Ż of the bodies what is left of each row (behind those of the freedoms), and what cut joints tell."""
        self._left(tape, Block(Space.A, self.system.neta, self.active), Z)
        for loop in self.loops:
            if loop.rubs:
                less = Block(Space.U, min(loop.rubs.element.eta), loop.closed.joint.kind.nv)
                self._told(tape, loop, self._given(loop), less, Z)

    def _left(self, tape: Tape, out: Block, Z: list[Block]) -> None:
        """What accelerations of the bodies leave of each row."""
        for loop in self.loops:
            c, own = loop.closed, loop.of(out)
            tape.call(Builtin.PICK, [c.blocks["xi"], own], [len(loop.rows), *loop.own])
            for body, which in c.ends:
                z = Z[body] if body != GROUND else self.scene.base
                for k, row in enumerate(loop.own):
                    tape.call(Builtin.PRODUCT, [c.row(which, row), z, own.part(k, 1)], [6, 1])

    def shift(self, tape: Tape) -> None:
        """Rates (nv) that change the rows by −gap, with the least change in the mass metric."""
        s, nv = self.recursive, self.system.nv
        tape.call(Builtin.SOLVE, [self.low, self.high, Block(Space.U, 0, self.active), self.lam], self.listed)
        y, Z = tape.scratch_block(nv), [tape.scratch_block(6) for _ in self.system.bodies]
        tape.zero(y)
        for loop in self.loops:
            loop.respond(tape, self.lam, y)
        for i, j in enumerate(self.system.tree):
            parent, own = self.scene.parent(i), s.stepping.own(y, j)
            qdd = Block(Space.OUT, j.v0, len(j.free))
            before = self.scene.zeros if parent == GROUND else Z[parent]
            self._call(tape, i, "swing", Z=before.part(0, 6), yc=own, qdd=qdd, Zo=Z[i])
