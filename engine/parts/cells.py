"""Directions as the machine reads them (``tr_directions``): vectors beside numbers, in cells that calls use together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate

from engine.parts.directions import Call, Directions, Marks
from engine.parts.tape import LANES, Block, Builtin, Space

Change = list[tuple[Block, int]]
"""What a direction changes: numbers, and where in x each one's size is (−1: one)."""


@dataclass
class Found:
    """The numbers of ``tr_directions``, and its tables."""

    sizes: dict[str, int]
    tables: dict[str, Sequence[int]]


def found(d: Directions, changes: Sequence[Change], outs: Sequence[Block], order: Sequence[int] = ()) -> Found:
    """Directions that each change something, in an order in which those behind each other change alike, and what they do to some
    numbers."""
    reached = [b in d.active for b in outs]
    w = _Cells(d, [*[b for c in changes for b, _ in c], *[b for b, r in zip(outs, reached, strict=True) if r]])
    first = [0, *accumulate(len(c) for c in changes)]
    seeds = [i for c in changes for b, rate in c for i in (*w.at(b), rate)]
    rows = [w.at(b)[0] if r else -1 for b, r in zip(outs, reached, strict=True)]
    sizes = {"length": len(w.code), "vectors": w.vectors, "cells": len(w.starts) - 1, "directions": len(changes), "rows": len(outs)}
    return Found(sizes, {"code": w.code, "cell": w.starts, "order": order, "first": first, "seed": seeds, "row": rows})


class _Cells:
    """Vectors and cells, and the code that calls them."""

    def __init__(self, d: Directions, outside: Sequence[Block]):
        """outside: what directions are given for and what is asked, whose vectors calls need not have."""
        self.used, begins = Marks(), Marks()
        d.calls = [c for c in d.calls if c.ins or any(b in d.active for b in c.outs)]
        calls = [[*c.ins, *c.outs, *c.added] for c in d.calls]
        spots = [[b for b, v in c.places if v and b is not None] for c in d.calls]
        for b in [*outside, *[b for of in [*calls, *spots] for b in of]]:
            self.used.add(b)
            begins.add(Block(b.space, b.at, 1))
            begins.add(Block(b.space, b.at + b.size, 1))
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

    def at(self, b: Block) -> tuple[int, int]:
        """Vector and cell of the first number of a block."""
        return self.vector[b.space][b.at], self.cell[b.space][b.at]

    def _cells(self, b: Block) -> list[int]:
        """First cell, and how many."""
        first, last = self.cell[b.space][b.at], self.cell[b.space][b.at + b.size - 1]
        return [first, last - first + 1]

    def _call(self, c: Call) -> list[int]:
        wide = [LANES * c.numbers[0]] if c.function in (Builtin.COPY, Builtin.ADD) and c.numbers else c.numbers
        head = [c.function, len(c.places), len(wide), len(c.ins), len(c.outs), len(c.added)]
        places: list[int] = []
        for b, vector in c.places:
            if not vector:
                assert b is not None
                places += [b.space, b.at]
            else:
                places += [Space.D, LANES * self.vector[b.space][b.at] if b is not None else 0]
        return [*head, *[i for b in [*c.ins, *c.outs, *c.added] for i in self._cells(b)], *places, *wide]
