"""Columns of the affine maps for a scene without friction in which few loops share bodies (theory, "Loops by structure"). The
columns of a loop extend only over the path of this loop. S has nonzero blocks only between loops whose paths share bodies."""

from __future__ import annotations

from trunnion.parts.bytecode.program import Builtin, Program, Slot, Space
from trunnion.parts.programs.evaluation_passes import EvaluationPasses
from trunnion.parts.programs.loop_slots import LoopPath, path_slots
from trunnion.system.structure.bodies_and_joints import GROUND
from trunnion.system.structure.loop_matrix_fill import coupled, rows_by_loop


class SparseForceColumns:
    """Writes the columns of all loops into a program."""

    def __init__(self, stepping: EvaluationPasses, program: Program):
        self.stepping, self.program = stepping, program
        self.scene, self.system, self.maps = stepping.scene, stepping.system, stepping.maps
        self.loops: list[LoopPath] = []
        found = rows_by_loop(self.system, stepping.active)
        self.near = coupled(self.system, [c for c, _ in found])
        for at, (c, rows) in enumerate(found):
            self._add_loop(at, LoopPath(*path_slots(stepping, stepping.closing(c), rows, program.scratch_slot)))

    def add(self, program: Program, out: Slot) -> None:
        """Add to ``out`` (nv) the accelerations that the multipliers z cause."""
        for loop in self.loops:
            loop.respond(program, Slot(Space.Z, 0, self.maps.columns), out)

    def _add_loop(self, at: int, r: LoopPath) -> None:
        """Write a loop's columns, its rows of g0, and its blocks of S: the diagonal block, and those with earlier loops."""
        program, m, c, own = self.program, self.maps, r.closed, r.own
        g0 = Slot(Space.MAPS, m.at("g0") + r.rows[0], len(r.rows))
        program.call(Builtin.SELECT, [c.blocks["xi"], g0], [len(own), *own])
        ends = [r.offsets[i] for i in (c.joint.inb, c.joint.out)]
        program.call(Builtin.WRENCH_COLUMNS, [c.blocks["gin"], c.blocks["gout"], r.pressed], [r.stride, *ends, len(own), *own])
        for k, row in enumerate(own):
            for body, g in c.ends[2:]:
                program.call(Builtin.ADD, [c.row(g, row), r.on(r.pressed, body, k)], [6])
            self._column(r, k)
        for first, count, n in [*r.runs(), (GROUND, 1, 0)]:
            body = first if first != GROUND else len(self.system.bodies)
            products = [(r.on(r.pressed, first, 0), self.scene.all_bias.slice(6 * body, 6 * count), 6 * count, r.stride)]
            if n:
                products += [(r.along.slice(r.at[first], n), self.stepping.y.slice(r.free[first][0], n), n, r.size)]
            for columns, known, length, stride in products:
                program.call(Builtin.ADD_TRANSPOSED_PRODUCT, [columns, known, g0], [length, len(own), stride])
        self.loops.append(r)
        for number in sorted(k for k in (at, *self.near[at]) if k <= at):
            self._couple(r, self.loops[number])

    def _column(self, r: LoopPath, k: int) -> None:
        """Reduce column k inward."""
        program, s = self.program, self.stepping
        for i in reversed(r.at):
            n = len(self.system.tree[i].free)
            y, along = (b.slice(r.size * k + r.at[i], n) for b in (r.y, r.along))
            self.scene.body_call(program, i, "column", work=s.moving[i].work, kept=s.kept[i], effort=self.scene.zeros, yc=y,
                                 fq=along, fc=r.on(r.pressed, i, k), up=r.on(r.pressed, self.scene.parent(i), k))  # fmt: skip

    def _couple(self, r: LoopPath, other: LoopPath) -> None:
        """Write the block of S between two loops if their paths share bodies."""
        into, across = len(other.rows), len(r.rows)
        shared = [run for run in r.runs(other) if run[2]]
        for number, (first, _, n) in enumerate(shared):
            along, y = other.along.slice(other.at[first], 0), r.y.slice(r.at[first], 0)
            out = Slot(Space.MAPS, self.maps.at("S") + self.maps.entry(other.rows[0], r.rows[0]), 0)
            how = [n, into, across, other.size, r.size, into, int(number == 0)]
            if r is other:
                self.program.call(Builtin.MIRRORED_PRODUCT, [along, y, out, out], [*how, 1])
            else:
                self.program.call(Builtin.TRANSPOSED_PRODUCT, [along, y, out], how)
