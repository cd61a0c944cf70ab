"""Refinement: finds where a result jumps or has a kink, or where an outcome changes, by halving boxes.

A box in the space of the varied numbers has a case at each corner. Halving the box along one axis adds cases in the middles of the
edges along this axis. The deviation of a middle case from linear interpolation measures the curvature of the result. The boxes with
the largest product of curvature and size are halved next; different outcomes at the corners count as curvature 1. The search ends
when all boxes with different outcomes or curvature are narrower than the tolerance, or after the allowed number of cases.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np

from trunnion.analysis.studies.study_rounds import REVISION, CaseResults, Rounds, Study
from trunnion.basics.lazy_data_classes import dataclass

GRID = 1 << 40
"""Number of grid intervals of each range. Places of cases are integers on this grid. Therefore equal places give bitwise equal
numbers."""
BOXES_PER_ROUND = 8
"""Number of boxes halved in one round."""
SLENDER = 4
"""Largest ratio of a box's longest side to its shortest side. A more slender box is halved across its longest side."""
FLAT, JUMP = 0.002, 0.02
"""Both values are relative to the range of the result. FLAT: curvature below which a result counts as linear. JUMP: change across a
box of least width above which the change counts as a jump."""
OUTCOME = "outcome"
MOST_REPORTED = 1000
Place = tuple[int, ...]


@dataclass(frozen=True)
class Box:
    """A box. low, high: opposite corners on the grid; curvature: deviation of the result from linear interpolation, relative to the
    range of the result."""

    low: Place
    high: Place
    curvature: float

    def corners(self) -> list[Place]:
        """All corners of the box."""
        return list(product(*zip(self.low, self.high, strict=True)))

    def sides(self) -> np.ndarray:
        """Side lengths, relative to the ranges of the varied numbers."""
        return (np.array(self.high, float) - np.array(self.low, float)) / GRID


@dataclass(frozen=True)
class BoxRefinement(Study):
    """The request of a refinement. of: name of the result, or OUTCOME; tolerance: least width of a box, relative to the ranges.
    With revision 1, the search ends as soon as a whole round would exceed the allowed number of cases."""

    kind = "refine"
    of: str

    @property
    def results(self) -> tuple[str, ...]:
        """The reductions that the study needs."""
        return () if self.of == OUTCOME else (self.of,)

    def rounds(self, report: Callable[[dict[str, Any]], None]) -> Rounds:
        """The cases of this refinement in rounds (``Study.rounds``)."""
        d = len(self.paths)
        steps = 8 if d == 1 else 4 if d == 2 else 2
        at = [GRID // steps * i for i in range(steps + 1)]
        map_ = _BoxMap(self)
        first = list(product(*[at] * d))[: self.most]
        map_.add(first, (yield self._numbers(first)))
        map_.boxes = [
            Box(tuple(at[i] for i in k), tuple(at[i + 1] for i in k), 1.0)
            for k in product(range(steps), repeat=d)
            if all(c in map_.ends for c in Box(tuple(at[i] for i in k), tuple(at[i + 1] for i in k), 1.0).corners())
        ]
        while True:
            report(map_.answer("not ended yet"))
            chosen = map_.choose_boxes()
            if not chosen:
                return map_.answer("every box is narrower than the tolerance, or the result is nearly linear inside the box")
            new = map_.new_places(chosen)
            while self.revision >= REVISION and len(map_.ends) + len(new) > self.most and len(chosen) > 1:
                chosen.pop()
                new = map_.new_places(chosen)
            if len(map_.ends) + len(new) > self.most:
                return map_.answer("the allowed number of cases is used up")
            if new:
                map_.add(new, (yield self._numbers(new)))
            for box, axis in chosen:
                map_.halve(box, axis)

    def _numbers(self, places: list[Place]) -> np.ndarray:
        """The parameter values at grid places, SI units (places × paths)."""
        return self.numbers(np.array(places, float).reshape(len(places), -1) / GRID)


def _edge_middles(box: Box, axis: int) -> list[Place]:
    """The middles of a box's edges along one axis."""
    middle = (box.low[axis] + box.high[axis]) // 2
    return list(dict.fromkeys((*c[:axis], middle, *c[axis + 1 :]) for c in box.corners()))


class _BoxMap:
    """All cases by place, and the boxes between them. ends: {place: (case index, outcome, value)}."""

    def __init__(self, wanted: BoxRefinement):
        self.wanted = wanted
        self.ends: dict[Place, tuple[int, str, float]] = {}
        self.boxes: list[Box] = []

    def add(self, places: list[Place], seen: CaseResults) -> None:
        """Add the results of a round."""
        values = seen.numbers[self.wanted.of] if self.wanted.results else np.zeros(len(seen))
        for place, outcome, value in zip(places, seen.outcomes, values.tolist(), strict=True):
            known = "" if outcome != "done" or value == value else " without a value"
            self.ends[place] = (len(self.ends), outcome + known, value if outcome == "done" else float("nan"))

    def new_places(self, chosen: list[tuple[Box, int]]) -> list[Place]:
        """The places of the cases that halving these boxes adds."""
        return list(dict.fromkeys(m for box, axis in chosen for m in _edge_middles(box, axis) if m not in self.ends))

    def _range(self) -> float:
        """Range of the result over all cases; 1 if the result is constant."""
        known = [v for _, _, v in self.ends.values() if v == v]
        return (max(known) - min(known) if known else 0.0) or 1.0

    def outcomes(self, box: Box) -> list[str]:
        """The distinct outcomes at the corners of a box."""
        return list(dict.fromkeys(self.ends[c][1] for c in box.corners()))

    def largest_change(self, box: Box, axis: int, whole: float) -> float:
        """Largest change of the result along those edges of a box that are parallel to an axis, relative to the range ``whole``.
        The change counts as 1 if the outcomes at the ends of an edge differ."""
        most = 0.0
        for c in box.corners():
            if c[axis] == box.low[axis]:
                a, b = self.ends[c], self.ends[(*c[:axis], box.high[axis], *c[axis + 1 :])]
                most = max(most, 1.0 if a[1] != b[1] else abs(a[2] - b[2]) / whole if a[2] == a[2] else 0.0)
        return most

    def choose_boxes(self) -> list[tuple[Box, int]]:
        """The boxes to halve next, each with the axis to halve: (box, axis)."""
        whole = self._range()
        d, rated = len(self.wanted.paths), []
        for n, box in enumerate(self.boxes):
            sides = box.sides()
            changed = len(self.outcomes(box)) > 1
            if sides.max() <= self.wanted.tolerance or (not changed and box.curvature < FLAT):
                continue
            rises = [self.largest_change(box, k, whole) if sides[k] > self.wanted.tolerance else -1.0 for k in range(d)]
            axis = int(np.argmax(sides))
            if sides.max() <= SLENDER * sides.min():
                axis = max(range(d), key=lambda k, r=rises, s=sides: (r[k], s[k], -k))  # type: ignore[misc]
            worth = (1.0 if changed else box.curvature) * float(np.prod(sides)) ** (1.0 / d)
            rated.append((-worth, n, box, axis))
        return [(box, axis) for _, _, box, axis in sorted(rated, key=lambda r: r[:2])[:BOXES_PER_ROUND]]

    def halve(self, box: Box, axis: int) -> None:
        """Replace a box by its two halves. The new cases determine the curvature of the halves."""
        whole, middle, bends = self._range(), (box.low[axis] + box.high[axis]) // 2, 0.0
        for c in box.corners():
            if c[axis] == box.low[axis]:
                a, m, b = (self.ends[(*c[:axis], x, *c[axis + 1 :])][2] for x in (box.low[axis], middle, box.high[axis]))
                off = abs(m - 0.5 * (a + b)) / whole
                bends = max(bends, off if off == off else 0.0)
        self.boxes.remove(box)
        for low, high in ((box.low[axis], middle), (middle, box.high[axis])):
            half = Box((*box.low[:axis], low, *box.low[axis + 1 :]), (*box.high[:axis], high, *box.high[axis + 1 :]), 0.0)
            steep = max(self.largest_change(half, k, whole) for k in range(len(self.wanted.paths)))
            self.boxes.append(Box(half.low, half.high, max(0.25 * bends, min(steep, 2.0 * bends))))

    def answer(self, why: str) -> dict[str, Any]:
        """The answer as plain data: boxes in which outcomes change or the result jumps."""
        w, whole, found = self.wanted, self._range(), []
        for box in self.boxes:
            ends = self.outcomes(box)
            rise = max(self.largest_change(box, k, whole) for k in range(len(w.paths)))
            narrow = box.sides().max() <= w.tolerance
            if len(ends) > 1 or (narrow and rise > JUMP and box.curvature > 0.5 * rise):
                a, b = w._numbers([box.low, box.high]).tolist()
                told = {"low": a, "high": b, "outcomes": ends, "narrow": bool(narrow)}
                found.append(told | {"change": rise * whole if len(ends) == 1 else None})
        found.sort(key=lambda f: f["low"])
        return {
            "kind": w.kind,
            "of": w.of,
            "why": why,
            "paths": list(w.paths),
            "units": list(w.units),
            "boundaries": found[:MOST_REPORTED],
            "more": max(0, len(found) - MOST_REPORTED),
            "cases": len(self.ends),
        }
