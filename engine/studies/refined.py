"""Where a result jumps or bends, or an outcome changes: boxes are halved where that is.

A box of the numbers' ranges has a case at each corner. Halving it across one number adds cases in the middle of its edges; how far
they are from what lies between the ends says how much the result bends there. Boxes whose corners end differently, or whose result
bends most for their size, are next, until all those are narrower than the tolerance or the cases are used up.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from engine.studies.following import Asking, Seen

FINE = 1 << 40
"""Places are whole multiples of the ranges over this, so that the same place is the same number."""
AT_ONCE = 8
"""Boxes that are halved in a round."""
SLENDER = 4
"""A box so many times as long as it is wide is halved across its length."""
FLAT, JUMP = 0.002, 0.02
"""Of the result's range: what bends less is straight enough; what changes by more across a box of the least width, and not
bit by bit, jumps."""
OUTCOME = "outcome"
MOST_TOLD = 1000
Place = tuple[int, ...]


@dataclass(frozen=True)
class Box:
    """Corners and size. low, high: corners; bends: how far the result was off a straight line where the box was made, of its
    range."""

    low: Place
    high: Place
    bends: float

    def corners(self) -> list[Place]:
        """All its corners."""
        return list(product(*zip(self.low, self.high, strict=True)))

    def sides(self) -> np.ndarray:
        """Its lengths, of the ranges."""
        return (np.array(self.high, float) - np.array(self.low, float)) / FINE


@dataclass(frozen=True)
class Refined:
    """What is wanted. low, high: ranges of the numbers, SI; of: a result, or OUTCOME alone; tolerance: the least width of a box, of
    the ranges."""

    paths: tuple[str, ...]
    units: tuple[str, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    of: str
    most: int = 200
    tolerance: float = 1e-3
    kind: str = "refine"

    @property
    def results(self) -> tuple[str, ...]:
        """The reductions it needs."""
        return () if self.of == OUTCOME else (self.of,)

    def asks(self, told: Callable[[dict[str, Any]], None]) -> Asking:
        """Its cases in rounds."""
        d = len(self.paths)
        steps = 8 if d == 1 else 4 if d == 2 else 2
        at = [FINE // steps * i for i in range(steps + 1)]
        map_ = _Map(self)
        first = list(product(*[at] * d))[: self.most]
        map_.add(first, (yield self._numbers(first)))
        map_.boxes = [
            Box(tuple(at[i] for i in k), tuple(at[i + 1] for i in k), 1.0)
            for k in product(range(steps), repeat=d)
            if all(c in map_.ends for c in Box(tuple(at[i] for i in k), tuple(at[i + 1] for i in k), 1.0).corners())
        ]
        while True:
            told(map_.answer("it goes on"))
            chosen = map_.next()
            if not chosen:
                return map_.answer("straight enough everywhere, or narrower than the tolerance")
            new = list(dict.fromkeys(m for box, axis in chosen for m in _middles(box, axis) if m not in map_.ends))
            if len(map_.ends) + len(new) > self.most:
                return map_.answer("its cases are used up")
            if new:
                map_.add(new, (yield self._numbers(new)))
            for box, axis in chosen:
                map_.halve(box, axis)

    def _numbers(self, places: list[Place]) -> np.ndarray:
        """The numbers of places, SI."""
        unit = np.array(places, float).reshape(len(places), -1) / FINE
        low, high = np.array(self.low), np.array(self.high)
        return low + (high - low) * unit


def _middles(box: Box, axis: int) -> list[Place]:
    """The middles of a box's edges along one number."""
    middle = (box.low[axis] + box.high[axis]) // 2
    return list(dict.fromkeys((*c[:axis], middle, *c[axis + 1 :]) for c in box.corners()))


class _Map:
    """All cases so far by place, and the boxes between them."""

    def __init__(self, wanted: Refined):
        self.wanted = wanted
        self.ends: dict[Place, tuple[int, str, float]] = {}
        self.boxes: list[Box] = []

    def add(self, places: list[Place], seen: Seen) -> None:
        """Keep what a round gave."""
        values = seen.numbers[self.wanted.of] if self.wanted.results else np.zeros(len(seen))
        for place, outcome, value in zip(places, seen.outcomes, values.tolist(), strict=True):
            known = "" if outcome != "done" or value == value else " without a value"
            self.ends[place] = (len(self.ends), outcome + known, value if outcome == "done" else float("nan"))

    def _range(self) -> float:
        """How far the result reaches; 1 where it is the same everywhere."""
        known = [v for _, _, v in self.ends.values() if v == v]
        return (max(known) - min(known) if known else 0.0) or 1.0

    def changes(self, box: Box) -> list[str]:
        """The outcomes at its corners."""
        return list(dict.fromkeys(self.ends[c][1] for c in box.corners()))

    def rise(self, box: Box, axis: int, whole: float) -> float:
        """How much the result changes along its edges across one number at most, of its range; 1 where outcomes do."""
        most = 0.0
        for c in box.corners():
            if c[axis] == box.low[axis]:
                a, b = self.ends[c], self.ends[(*c[:axis], box.high[axis], *c[axis + 1 :])]
                most = max(most, 1.0 if a[1] != b[1] else abs(a[2] - b[2]) / whole if a[2] == a[2] else 0.0)
        return most

    def next(self) -> list[tuple[Box, int]]:
        """The boxes to halve, and across which number."""
        whole = self._range()
        d, rated = len(self.wanted.paths), []
        for n, box in enumerate(self.boxes):
            sides = box.sides()
            changed = len(self.changes(box)) > 1
            if sides.max() <= self.wanted.tolerance or (not changed and box.bends < FLAT):
                continue
            rises = [self.rise(box, k, whole) if sides[k] > self.wanted.tolerance else -1.0 for k in range(d)]
            axis = int(np.argmax(sides))
            if sides.max() <= SLENDER * sides.min():
                axis = max(range(d), key=lambda k, r=rises, s=sides: (r[k], s[k], -k))  # type: ignore[misc]
            worth = (1.0 if changed else box.bends) * float(np.prod(sides)) ** (1.0 / d)
            rated.append((-worth, n, box, axis))
        return [(box, axis) for _, _, box, axis in sorted(rated, key=lambda r: r[:2])[:AT_ONCE]]

    def halve(self, box: Box, axis: int) -> None:
        """Replace a box by its halves, which know how much the result bends there."""
        whole, middle, bends = self._range(), (box.low[axis] + box.high[axis]) // 2, 0.0
        for c in box.corners():
            if c[axis] == box.low[axis]:
                a, m, b = (self.ends[(*c[:axis], x, *c[axis + 1 :])][2] for x in (box.low[axis], middle, box.high[axis]))
                off = abs(m - 0.5 * (a + b)) / whole
                bends = max(bends, off if off == off else 0.0)
        self.boxes.remove(box)
        for low, high in ((box.low[axis], middle), (middle, box.high[axis])):
            half = Box((*box.low[:axis], low, *box.low[axis + 1 :]), (*box.high[:axis], high, *box.high[axis + 1 :]), 0.0)
            steep = max(self.rise(half, k, whole) for k in range(len(self.wanted.paths)))
            self.boxes.append(Box(half.low, half.high, max(0.25 * bends, min(steep, 2.0 * bends))))

    def answer(self, why: str) -> dict[str, Any]:
        """Where outcomes change and the result jumps, as boxes of the least width."""
        w, whole, found = self.wanted, self._range(), []
        low, high = np.array(w.low), np.array(w.high)
        for box in self.boxes:
            ends = self.changes(box)
            rise = max(self.rise(box, k, whole) for k in range(len(w.paths)))
            narrow = box.sides().max() <= w.tolerance
            if len(ends) > 1 or (narrow and rise > JUMP and box.bends > 0.5 * rise):
                a, b = (low + (high - low) * np.array(x, float) / FINE for x in (box.low, box.high))
                told = {"low": a.tolist(), "high": b.tolist(), "outcomes": ends, "narrow": bool(narrow)}
                found.append(told | {"change": rise * whole if len(ends) == 1 else None})
        found.sort(key=lambda f: f["low"])
        return {
            "kind": w.kind,
            "of": w.of,
            "why": why,
            "paths": list(w.paths),
            "units": list(w.units),
            "boundaries": found[:MOST_TOLD],
            "more": max(0, len(found) - MOST_TOLD),
            "cases": len(self.ends),
        }
