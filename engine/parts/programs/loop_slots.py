"""Slots of loops."""

from __future__ import annotations

from typing import Any

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.parts.bytecode.body_and_joint_slots import Allocate, CutJointSlots
from trunnion.parts.bytecode.program import Builtin, Program, Slot
from trunnion.parts.layout.loop_matrix import LoopMatrix
from trunnion.parts.programs.evaluation_passes import EvaluationPasses
from trunnion.system.structure.bodies_and_joints import GROUND
from trunnion.system.structure.friction_joint_indices import Element
from trunnion.system.structure.loop_matrix_fill import path


@dataclass
class CutJointFriction:
    """Friction of a cut joint with nv freedoms and n multipliers λ. The law needs the reaction components f = p0 + ``by_rows`` λ −
    ``by_friction`` η. The linearised law has a remainder e. Elimination of η from this law gives −η = ``inverse`` (−e) + ``less`` +
    ``turned`` λ."""

    element: Element
    by_rows: Slot
    by_friction: Slot
    p0: Slot
    inverse: Slot
    turned: Slot
    less: Slot
    eta: Slot


@dataclass
class LoopPath:
    """A loop and the bodies on its path.

    rows: indices of the loop's n multipliers in λ. own: indices of these rows among the rows of the cut joint. at: for each body,
    the start of its free rates among the ``size`` free rates of the path. free: for each body, the start of its free rates among
    all free rates, and their number. y, along: accelerations and forces along the freedoms (size × n each). pressed: force columns
    (6 × n) on each body, then on the ground.
    """

    closed: CutJointSlots
    rows: list[int]
    own: list[int]
    at: dict[int, int]
    free: dict[int, tuple[int, int]]
    y: Slot
    along: Slot
    pressed: Slot

    def __post_init__(self) -> None:
        self.size = sum(n for _, n in self.free.values())
        self.offsets = {i: 6 * k for k, i in enumerate(self.at)} | {GROUND: self.stride - 6}

    @property
    def stride(self) -> int:
        """Number of doubles of a force column on all bodies."""
        return 6 * (len(self.at) + 1)

    def on(self, of: Slot, i: int, k: int) -> Slot:
        """The part of column or row k on body i (6)."""
        return of.slice(self.stride * k + self.offsets[i], 6)

    def of(self, lam: Slot) -> Slot:
        """The multipliers of this loop, among the multipliers λ of all loops."""
        return lam.slice(self.rows[0], len(self.rows))

    def runs(self, other: LoopPath | None = None) -> list[tuple[int, int, int]]:
        """Runs of consecutively numbered bodies on the path; with ``other``, on both paths. For each run: first body, number of
        bodies, number of free rates."""
        out: list[tuple[int, int, int]] = []
        for i in self.at:
            if other is not None and i not in other.at:
                continue
            first, count, n = out[-1] if out else (i, 0, 0)
            if first + count == i:
                out[-1:] = [(first, count + 1, n + self.free[i][1])]
            else:
                out.append((i, 1, self.free[i][1]))
        return out

    def respond(self, program: Program, lam: Slot, y: Slot) -> None:
        """Add to y (nv) the accelerations that this loop's multipliers cause along the path. lam: multipliers of all loops."""
        for first, _, n in self.runs():
            if n:
                own = self.y.slice(self.at[first], self.y.size - self.at[first])
                program.call(
                    Builtin.ADD_STRIDED_COLUMNS,
                    [own, self.of(lam), y.slice(self.free[first][0], n)],
                    [n, len(self.rows), self.size],
                )


def path_slots(
    stepping: EvaluationPasses, c: CutJointSlots, rows: list[int], allocate: Allocate
) -> tuple[Any, Any, Any, Any, Any, Slot, Slot, Slot]:
    """Arguments of a LoopPath. The slot y is in W, where other functions of the kernel can read it. ``allocate`` provides all other
    slots."""
    tree, at, size, n = stepping.system.tree, {}, 0, len(rows)
    for i in path(stepping.system, c.joint):
        at[i] = size
        size += len(tree[i].free)
    own = [stepping.active[r] - c.joint.rows for r in rows]
    free = {i: (tree[i].v0, len(tree[i].free)) for i in at}
    y, along = stepping.kept_slot(size * n), allocate(size * n)
    return c, rows, own, at, free, y, along, allocate(6 * (len(at) + 1) * n)


@dataclass
class FrictionLoop(LoopPath):
    """A loop in a mechanism with friction. sensed: rows of the loop's constraint equations on the bodies, in the layout of
    ``pressed``. With friction, their values differ from ``pressed``. friction: friction of the loop's cut joint."""

    sensed: Slot
    friction: CutJointFriction | None = None

    def meet(self, program: Program, other: FrictionLoop, matrix: LoopMatrix, S: Slot) -> None:
        """Write the blocks of S between this loop and ``other`` (which may be this loop) if a body with freedoms is on both
        paths."""
        shared = [run for run in self.runs(other) if run[2]]
        for one, two in ((self, other), (other, self)) if other is not self else ((self, self),):
            for number, (first, _, n) in enumerate(shared):
                out = S.slice(matrix.at(one.rows[0], two.rows[0]), 1)
                rows, columns = one.along.slice(one.at[first], n), two.y.slice(two.at[first], n)
                how = [n, len(one.rows), len(two.rows), one.size, two.size, len(one.rows), int(number == 0)]
                program.call(Builtin.TRANSPOSED_PRODUCT, [rows, columns, out], how)
