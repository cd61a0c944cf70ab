"""Columns of the affine maps where few loops share bodies and nothing rubs: each is followed along the path of its own loop only,
and S has entries only of loops whose paths meet (METHOD, "Loops by structure"). The others are zeros that nobody writes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from engine.parts.tape import Block, Builtin, Space, Tape
from engine.system.coupling import path, rows_by_loop
from engine.system.structure import GROUND, Joint

if TYPE_CHECKING:
    from engine.parts.stepping import Stepping


@dataclass(frozen=True)
class Response:
    """What the multipliers of a loop do along its path. rows: their places in λ; at: where the free rates of each body of the path
    begin among them (their count in all: size); y, along: accelerations and forces along the freedoms (size × rows); forces: on the
    bodies, on the ground last (6 each × rows)."""

    joint: Joint
    rows: list[int]
    at: dict[int, int]
    size: int
    y: Block
    along: Block
    forces: Block

    @property
    def each(self) -> int:
        """Numbers of the forces of a row."""
        return 6 * (len(self.at) + 1)

    def force(self, i: int, k: int) -> Block:
        """Force of row k on body i."""
        return self.forces.part(self.each * k + (6 * list(self.at).index(i) if i != GROUND else self.each - 6), 6)


class Apart:
    """Writes the columns behind a tape, and what they do to accelerations behind another."""

    def __init__(self, stepping: Stepping, tape: Tape):
        self.stepping, self.tape = stepping, tape
        self.scene, self.system, self.maps = stepping.scene, stepping.system, stepping.maps
        self.responses: list[Response] = []
        for c, rows in rows_by_loop(self.system, stepping.active):
            self._of_loop(self._room(c, rows))

    def add(self, tape: Tape, out: Block) -> None:
        """Add what the multipliers in z do to accelerations (nv)."""
        for r in self.responses:
            z = Block(Space.Z, r.rows[0], len(r.rows))
            for first, _, n in self._runs(r):
                own = r.y.part(r.at[first], r.y.size - r.at[first])
                tape.call(Builtin.SPREAD, [own, z, out.part(self._v0(first), n)], [n, len(r.rows), r.size])

    # -- one loop -----------------------------------------------------------------------------------------------------------

    def _v0(self, i: int) -> int:
        return self.system.tree[i].v0

    def _room(self, c: Joint, rows: list[int]) -> Response:
        at, size = {}, 0
        for i in path(self.system, c):
            at[i] = size
            size += len(self.system.tree[i].free)
        y, along = self.stepping.w_block(size * len(rows)), self.tape.scratch_block(size * len(rows))
        return Response(c, rows, at, size, y, along, self.tape.scratch_block(6 * (len(at) + 1) * len(rows)))

    def _runs(self, r: Response, other: Response | None = None) -> list[tuple[int, int, int]]:
        """Bodies of a path (that it shares with another) that follow each other: the first, how many, and their free rates."""
        out: list[tuple[int, int, int]] = []
        for i in r.at:
            n = len(self.system.tree[i].free)
            if other is not None and i not in other.at:
                continue
            if out and sum(out[-1][:2]) == i:
                first, count, size = out.pop()
                out.append((first, count + 1, size + n))
            else:
                out.append((i, 1, n))
        return out

    def _of_loop(self, r: Response) -> None:
        """Its columns, its rows of g0, and its blocks of S with itself and with the loops before it that it meets."""
        tape, m, c = self.tape, self.maps, self.stepping.closing(r.joint)
        own = [self.stepping.active[row] - r.joint.rows for row in r.rows]
        g0 = Block(Space.MAPS, m.at("g0") + r.rows[0], len(r.rows))
        tape.call(Builtin.PICK, [c.blocks["xi"], g0], [len(own), *own])
        at = [r.force(i, 0).at - r.forces.at for i in (r.joint.inb, r.joint.out)]
        tape.call(Builtin.WRENCHES, [c.blocks["gin"], c.blocks["gout"], r.forces], [r.each, *at, len(own), *own])
        for k, row in enumerate(own):
            for body, g in c.ends[2:]:
                tape.call(Builtin.ADD, [c.row(g, row), r.force(body, k)], [6])
            self._column(r, k)
        for first, count, n in [*self._runs(r), (GROUND, 1, 0)]:
            body = first if first != GROUND else len(self.system.bodies)
            products = [(r.force(first, 0), self.scene.all_bias.part(6 * body, 6 * count), 6 * count, r.each)]
            if n:
                products += [(r.along.part(r.at[first], n), self.stepping.y.part(self._v0(first), n), n, r.size)]
            for columns, known, length, stride in products:
                tape.call(Builtin.GRAM, [columns, known, g0], [length, len(own), stride])
        self.responses.append(r)
        for other in self.responses:
            self._couple(r, other)

    def _column(self, r: Response, k: int) -> None:
        """Inward from the bodies that are acted on."""
        tape, s = self.tape, self.stepping
        for i in reversed(r.at):
            n = len(self.system.tree[i].free)
            y, along = (b.part(r.size * k + r.at[i], n) for b in (r.y, r.along))
            self.scene.body_call(tape, i, "column", work=s.moving[i].work, kept=s.kept[i], effort=self.scene.zeros, yc=y, fq=along,
                                 fc=r.force(i, k), up=r.force(self.scene.parent(i), k))  # fmt: skip

    def _couple(self, r: Response, other: Response) -> None:
        """The blocks of S between two loops, if their paths meet."""
        a, into, across = self.maps.active, len(other.rows), len(r.rows)
        upper, lower = (Block(Space.MAPS, a * j[0] + i[0], 0) for i, j in ((other.rows, r.rows), (r.rows, other.rows)))
        shared = [run for run in self._runs(r, other) if run[2]]
        for number, (first, _, n) in enumerate(shared):
            along, y = other.along.part(other.at[first], 0), r.y.part(r.at[first], 0)
            how = [n, into, across, other.size, r.size, a, int(number == 0), int(r is other)]
            self.tape.call(Builtin.COUPLE, [along, y, upper, lower], how)
