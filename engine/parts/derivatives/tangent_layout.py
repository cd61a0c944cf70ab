"""Layout of tangents and cells, and the program of tangents (``tr_directions``)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.parts.bytecode.program import LANES, Builtin, Slot, Space
from trunnion.parts.derivatives.forward_mode import Directions, SlotSet, TangentCall

Change = list[tuple[Slot, int]]
"""A direction: pairs of a slot that changes, and the index in x of this slot's rate of change (−1: rate 1)."""


@dataclass
class TangentTables:
    """The counts and tables of ``tr_directions``."""

    sizes: dict[str, int]
    tables: dict[str, Sequence[int]]


def tangent_tables(d: Directions, changes: Sequence[Change], outs: Sequence[Slot], order: Sequence[int] = ()) -> TangentTables:
    """Tables of the directions ``changes`` and of the outputs ``outs``. order: order in which the directions are evaluated.
    Directions that change the same cells should be adjacent."""
    reached = [b in d.active for b in outs]
    w = _Cells(d, [*[b for c in changes for b, _ in c], *[b for b, r in zip(outs, reached, strict=True) if r]])
    first = [0, *accumulate(len(c) for c in changes)]
    seeds = [i for c in changes for b, rate in c for i in (*w.at(b), rate)]
    rows = [w.at(b)[0] if r else -1 for b, r in zip(outs, reached, strict=True)]
    sizes = {"length": len(w.code), "vectors": w.vectors, "cells": len(w.starts) - 1, "directions": len(changes), "rows": len(outs)}
    return TangentTables(sizes, {"code": w.code, "cell": w.starts, "order": order, "first": first, "seed": seeds, "row": rows})


class _Cells:
    """Positions of tangents and cells, and the program that uses these positions."""

    def __init__(self, d: Directions, outside: Sequence[Slot]):
        """outside: output slots, and slots that directions change. These slots get tangents even if no call uses them."""
        self.used, begins = SlotSet(), SlotSet()
        d.calls = [c for c in d.calls if c.ins or any(b in d.active for b in c.outs)]
        calls = [[*c.ins, *c.outs, *c.added] for c in d.calls]
        spots = [[b for b, v in c.operands if v and b is not None] for c in d.calls]
        for b in [*outside, *[b for of in [*calls, *spots] for b in of]]:
            self.used.add(b)
            begins.add(Slot(b.space, b.at, 1))
            begins.add(Slot(b.space, b.at + b.size, 1))
        self.zeros = max([1, *[b.size for of in spots for b in of]])
        self.vector: dict[Space, list[int]] = {}
        self.cell: dict[Space, list[int]] = {}
        self.starts: list[int] = []
        count = self.zeros
        for space, used in self.used.of.items():
            edge = begins.of[space].ljust(len(used) + 1, b"\0")
            self.vector[space] = [count + k for k in accumulate(used, initial=0)]
            first, before = [], 0
            for i, here in enumerate(used):
                if here and (edge[i] or not before):
                    self.starts.append(self.vector[space][i])
                before = here
                first.append(len(self.starts) - 1)
            self.cell[space] = first
            count = self.vector[space][-1]
        self.vectors = count
        self.starts.append(count)
        self.code = [i for c in d.calls for i in self._call(c)]

    def at(self, b: Slot) -> tuple[int, int]:
        """Indices of the tangent and the cell of a slot's first number."""
        return self.vector[b.space][b.at], self.cell[b.space][b.at]

    def _cells(self, b: Slot) -> list[int]:
        """Index of a slot's first cell, and number of the slot's cells."""
        first, last = self.cell[b.space][b.at], self.cell[b.space][b.at + b.size - 1]
        return [first, last - first + 1]

    def _call(self, c: TangentCall) -> list[int]:
        wide = [LANES * c.numbers[0]] if c.function in (Builtin.COPY, Builtin.ADD) and c.numbers else c.numbers
        head = [c.function, len(c.operands), len(wide), len(c.ins), len(c.outs), len(c.added)]
        operands: list[int] = []
        for b, vector in c.operands:
            if not vector:
                assert b is not None
                operands += [b.space, b.at]
            else:
                operands += [Space.D, LANES * self.vector[b.space][b.at] if b is not None else 0]
        return [*head, *[i for b in [*c.ins, *c.outs, *c.added] for i in self._cells(b)], *operands, *wide]
