"""Optimisation by a matrix adaptation evolution strategy (MA-ES, Beyer and Sendhoff 2017) within bounds and constraints.

The strategy uses only the rank of each case. Feasible cases come first, ranked by their goal; then infeasible cases, ranked by
their violation of the constraints; then cases without a value. Jumps, kinks and failed cases therefore do not disturb the search.
The first search begins at the best case of an initial sample. The second search begins at another point, with twice as many cases
in each round.

A search for a target value also uses the sign of the difference from the target. As soon as cases lie on both sides of the target,
``root_bracket`` takes a case from each side. Between the two cases, it searches for a place at which the result equals the target.
If the result jumps across the target between the two cases, the evolution strategy continues.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from math import inf, isfinite, log, sqrt
from typing import Any

import numpy as np

from trunnion.analysis.studies.root_bracket import bracketed_root
from trunnion.analysis.studies.study_rounds import REVISION, CaseResults, Rounds, Study
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.batch.cases.sample_points import latin

STARTS = 2
"""Number of searches."""
GOALS = ("minimise", "maximise", "reach")
FIRST, LEAST_ROUND = 4, 8
"""FIRST: number of cases of the initial sample per varied number, in addition to one round. LEAST_ROUND: least number of cases of
a round."""
FIRST_STEP = 0.6
"""Initial step size, relative to the spacing of the initial sample."""
REACHED = 1e-9
"""Relative difference from the target below which the target counts as reached."""
MOST_JUMPS = 3
"""Largest number of searches between two cases that end at a jump or at a failed case."""


@dataclass(frozen=True)
class Optimisation(Study):
    """The request of an optimisation. With revision 1, there is no search between two cases.

    Attributes:
        own: the scene's own values of the varied numbers, SI units.
        goal: one of GOALS.
        of: name of the result to optimise.
        target: value to reach if the goal is "reach".
        within: constraints (result, low, high).
        seed: seed of the random numbers.
        tolerance: a search ends when the standard deviation of its cases, relative to the ranges of the numbers, is below this
            value.
    """

    kind = "optimise"
    own: tuple[float, ...]
    goal: str
    of: str
    target: float
    within: tuple[tuple[str, float, float], ...]
    seed: int = 0

    @property
    def results(self) -> tuple[str, ...]:
        """The reductions that the study needs."""
        return tuple(dict.fromkeys((self.of, *(name for name, _, _ in self.within))))

    def rounds(self, report: Callable[[dict[str, Any]], None]) -> Rounds:
        """The cases of this optimisation in rounds (``Study.rounds``)."""
        tried = _Trials(self)
        d = len(self.paths)
        size = max(LEAST_ROUND, 4 + int(3 * log(d)))
        first = min(self.most, FIRST * d + size) - 1
        unit = np.vstack([self._start()[None, :], latin(first, d, self.seed)])
        ended = 0
        tried.add(unit, (yield self.numbers(unit)))
        begin, step = tried.places[tried.best], FIRST_STEP * len(unit) ** (-1.0 / d)
        while True:
            report(tried.answer(""))
            if (yield from self._between(tried, report)):
                return tried.answer("reached")
            strategy, why = _Strategy(begin, step, size, [self.seed, ended]), ""
            while not why:
                unit = strategy.round(self.most - len(tried))
                if not len(unit):
                    return tried.answer("the allowed number of cases is used up")
                strategy.learn(tried.add(unit, (yield self.numbers(unit))))
                report(tried.answer(""))
                found = yield from self._between(tried, report)
                why = "reached" if found or tried.reached() else "settled" if strategy.reach() < self.tolerance else ""
            ended += 1
            if why == "reached" or ended == STARTS:
                return tried.answer(why)
            size *= 2
            begin = latin(1, d, self.seed + 1 + ended)[0]

    def _between(self, tried: _Trials, report: Callable[[dict[str, Any]], None]) -> Generator[np.ndarray, CaseResults, bool]:
        """Search for the target between the best case and the nearest case on the other side of the target. Returns whether the
        best case then has the target value. Each pair of cases is tried once; after MOST_JUMPS searches without success, there is
        no further search."""
        pair = tried.pair() if self.goal == "reach" and self.revision >= REVISION and not tried.reached() else None
        if pair is None or tried.jumps == MOST_JUMPS:
            return False
        begin = len(tried)
        (low, high), sides = (tried.places[i] for i in pair), [tried.off_target(i) for i in pair]
        search = bracketed_root(sides[0], sides[1], REACHED * max(abs(self.target), 1e-300))
        share = next(search)
        while len(tried) < self.most:
            unit = (low + share * (high - low))[None, :]
            tried.add(unit, (yield self.numbers(unit)))
            report(tried.answer(""))
            try:
                share = search.send(tried.off_target(len(tried) - 1))
            except StopIteration as end:
                if end.value and tried.best >= begin:
                    return True
                break
        tried.jumps += 1
        return False

    def _start(self) -> np.ndarray:
        """The scene's own numbers, scaled to the unit box; a number outside its bounds becomes ½."""
        low, high, own = (np.array(x) for x in (self.low, self.high, self.own))
        return np.where((low <= own) & (own <= high), (own - low) / (high - low), 0.5)


class _Strategy:
    """The state of the evolution strategy in the unit box: mean, step size and transformation matrix."""

    def __init__(self, mean: np.ndarray, step: float, size: int, seed: list[int]):
        d, half = len(mean), size // 2
        self.mean, self.size = mean.copy(), size
        self.random = np.random.Generator(np.random.PCG64(seed))
        w = np.log(half + 0.5) - np.log(np.arange(1, half + 1))
        self.weights = w / w.sum()
        many = 1.0 / (self.weights**2).sum()
        self.slow = (many + 2.0) / (many + d + 5.0)
        self.one = 2.0 / ((d + 1.3) ** 2 + many)
        self.rest = min(1.0 - self.one, 2.0 * (many - 2.0 + 1.0 / many) / ((d + 2.0) ** 2 + many))
        self.damping = 1.0 + self.slow + 2.0 * max(0.0, sqrt((many - 1.0) / (d + 1.0)) - 1.0)
        self.usual = sqrt(d) * (1.0 - 1.0 / (4.0 * d) + 1.0 / (21.0 * d * d))
        self.gain = sqrt(self.slow * (2.0 - self.slow) * many)
        self.step, self.matrix, self.path = step, np.eye(d), np.zeros(d)
        self.drawn = self.moves = np.zeros((0, d))

    def round(self, left: int) -> np.ndarray:
        """The next cases (n × d), at most ``left``. Cases outside the unit box are reflected at its faces."""
        n = min(self.size, left)
        self.drawn = self.random.standard_normal((self.size, len(self.mean)))[:n]
        self.moves = (self.drawn[:, None, :] * self.matrix[None, :, :]).sum(axis=2)
        there = np.abs(self.mean + self.step * self.moves) % 2.0
        return np.where(there > 1.0, 2.0 - there, there)

    def learn(self, order: np.ndarray) -> None:
        """Update the strategy from the ranking of the round's cases (best case first)."""
        order = order[: len(self.weights)]
        w = self.weights[: len(order), None]
        z, moves = self.drawn[order], self.moves[order]
        middle = (w * z).sum(axis=0)
        self.mean = np.clip(self.mean + self.step * (w * moves).sum(axis=0), 0.0, 1.0)
        self.path = (1.0 - self.slow) * self.path + self.gain * middle
        eye = np.eye(len(middle))
        spread = (w[:, :, None] * z[:, :, None] * z[:, None, :]).sum(axis=0)
        change = eye + 0.5 * self.one * (np.multiply.outer(self.path, self.path) - eye) + 0.5 * self.rest * (spread - eye)
        self.matrix = (self.matrix[:, :, None] * change[None, :, :]).sum(axis=1)
        self.step = min(1.0, self.step * float(np.exp(self.slow / self.damping * (sqrt((self.path**2).sum()) / self.usual - 1.0))))

    def reach(self) -> float:
        """Standard deviation of the strategy's cases along the widest axis, relative to the ranges."""
        return self.step * float(np.sqrt((self.matrix**2).sum(axis=1)).max())


class _Trials:
    """All cases so far, with their ranks. best: index of the best case; among equal cases, the first."""

    def __init__(self, wanted: Optimisation):
        self.wanted = wanted
        self.places: list[np.ndarray] = []
        self.keys: list[tuple[int, float]] = []
        self.results: list[dict[str, float]] = []
        self.failed = self.best = 0
        self.paired, self.jumps = -1, 0
        self.scales: dict[str, float] = {}
        self.path: list[tuple[int, float]] = []

    def __len__(self) -> int:
        return len(self.keys)

    def add(self, unit: np.ndarray, seen: CaseResults) -> np.ndarray:
        """Add the results of a round; returns the indices of its cases, best case first."""
        begin, done = len(self), seen.done
        if not self.scales:
            for name, a, b in self.wanted.within:
                known = seen.numbers[name][done & ~np.isnan(seen.numbers[name])]
                ends = [abs(x) for x in (a, b) if isfinite(x) and x]
                self.scales[name] = float(known.std()) if len(known) and known.std() > 0.0 else max(ends, default=1.0)
        for i in range(len(seen)):
            result = {n: float(v[i]) for n, v in seen.numbers.items()}
            key = self._key(result) if done[i] else (2, 0.0)
            self.failed += key[0] == 2
            if not self.keys or key < self.keys[self.best]:
                self.best = len(self)
                self.path.append((len(self), result[self.wanted.of] if key[0] == 0 else float("nan")))
            self.places.append(unit[i])
            self.keys.append(key)
            self.results.append(result)
        return np.array(sorted(range(len(seen)), key=lambda i: (self.keys[begin + i], i)), int)

    def _key(self, result: dict[str, float]) -> tuple[int, float]:
        """Rank key of a case: (0, goal) if feasible, (1, violation of constraints) if infeasible, (2, 0) without a value."""
        w = self.wanted
        if any(result[n] != result[n] for n in w.results):
            return 2, 0.0
        missed = sum(max(a - result[n], result[n] - b, 0.0) / self.scales[n] for n, a, b in w.within)
        if missed > 0.0:
            return 1, missed
        value = result[w.of]
        return 0, {"minimise": value, "maximise": -value, "reach": abs(value - w.target)}[w.goal]

    def off_target(self, i: int) -> float:
        """The result of a case minus the target; NaN for a failed case."""
        return self.results[i][self.wanted.of] - self.wanted.target if self.keys[i][0] < 2 else float("nan")

    def pair(self) -> tuple[int, int] | None:
        """The best case, and the nearest case on the other side of the target. None if no case lies on that side, or if the best
        case violates constraints or was in a pair before."""
        if self.best == self.paired or self.keys[self.best][0] > 0:
            return None
        self.paired, off = self.best, np.array([self.off_target(i) for i in range(len(self))])
        others = np.flatnonzero(off * off[self.best] < 0.0)
        if not len(others):
            return None
        away = ((np.array(self.places)[others] - self.places[self.best]) ** 2).sum(axis=1)
        return self.best, int(others[np.argmin(away)])

    def reached(self) -> bool:
        """Whether the target is reached."""
        w, (kind, off) = self.wanted, self.keys[self.best]
        return w.goal == "reach" and kind == 0 and off <= REACHED * max(abs(w.target), 1e-300)

    def answer(self, why: str) -> dict[str, Any]:
        """The answer as plain data."""
        w, best = self.wanted, self.best
        kind, off = self.keys[best]
        values = w.numbers(self.places[best])
        words = {"": "not ended yet", "settled": f"the search converged to {w.tolerance:g} of the ranges"}
        words["reached"] = "the target is reached"
        return {
            "kind": w.kind,
            "goal": w.goal,
            "of": w.of,
            "target": w.target if w.goal == "reach" else None,
            "within": [{"of": n, **{k: v if abs(v) < inf else None for k, v in (("low", a), ("high", b))}} for n, a, b in w.within],
            "why": words.get(why, why),
            "settled": why in ("settled", "reached"),
            "feasible": kind == 0,
            "constraints_missed": off if kind == 1 else 0.0 if kind == 0 else None,
            "off_target": self.off_target(best) if w.goal == "reach" and kind < 2 else None,
            "case": best,
            "numbers": [{"path": p, "unit": u, "value": float(v)} for p, u, v in zip(w.paths, w.units, values, strict=True)],
            "results": {n: (v if abs(v) < inf else None) for n, v in self.results[best].items()} if kind < 2 else {},
            "cases": len(self),
            "failed": self.failed,
            "path": [{"case": i, "value": v if v == v else None} for i, v in self.path],
        }
