"""Cases of a batch: a grid, a list, or a seeded sample of a scene's numbers. The values of a case depend only on its index."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import field
from numbers import Real
from typing import Any

import numpy as np

from trunnion.basics.errors import MOST, Problem, SceneError
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.batch.cases.distributions import BELOW_ONE, spread_of
from trunnion.batch.cases.quantity_reader import Reader
from trunnion.batch.cases.sample_points import BITS, REPLICATES, points, width
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.findings.name_suggestions import listed as names_of

SAMPLINGS = ("latin", "random", "sobol", "saltelli")
LEAST_POINTS = 2 * REPLICATES
"""Least number of points of a crossed sample."""
MOST_VALUES = 1_000_000
"""Largest number of values that a list for one path may have."""


@dataclass(frozen=True)
class Cases:
    """The cases of a batch.

    Attributes:
        paths: paths of the varied numbers.
        units: SI units of these numbers.
        count: number of cases.
        values: function; values(start, stop) returns the values of cases start … stop − 1 ((stop − start) × paths), SI units.
        sampling: sampling method; "" for grids and lists.
        ends: bounds of the values of each path (2 × paths); None if unknown.
    """

    paths: tuple[str, ...]
    units: tuple[str, ...]
    count: int
    values: Callable[[int, int], np.ndarray] = field(compare=False)
    sampling: str = ""
    ends: np.ndarray | None = field(default=None, compare=False)

    def changes(self, index: int) -> dict[str, float]:
        """One case as overrides of the scene, {path: SI value}."""
        row = self.values(index, index + 1)[0]
        return dict(zip(self.paths, map(float, row), strict=True))


def grid(scene: Scene, vary: Mapping[str, Any], where: str = "vary") -> Cases:
    """Every combination of values; the last path varies fastest. vary: {path: list of values, or "first:last:count"}, with units.
    SceneError lists every mistake."""
    problems: list[Problem] = []
    readers = [Reader(scene, path, f"{where}.{path}", problems) for path in vary]
    axes = [_axis(reader, given) for reader, given in zip(readers, vary.values(), strict=True)]
    _end(problems, vary, where, sum(r.untold for r in readers))
    shape = tuple(len(a) for a in axes)

    def values(start: int, stop: int) -> np.ndarray:
        places = np.unravel_index(np.arange(start, stop), shape)
        return np.column_stack([a[p] for a, p in zip(axes, places, strict=True)])

    return Cases(tuple(vary), tuple(r.unit for r in readers), math.prod(shape), values, ends=_ends(axes))


def listed(scene: Scene, cases: Sequence[Mapping[str, Any]], where: str = "cases") -> Cases:
    """The given cases, each {path: value}. All cases must have the same paths. A single case may be empty. An empty case is the
    unchanged scene. SceneError lists every mistake."""
    if list(cases) == [{}]:
        return Cases((), (), 1, lambda start, stop: np.zeros((stop - start, 0)))
    problems: list[Problem] = []
    paths = tuple(cases[0]) if cases else ()
    odd = [i for i, case in enumerate(cases) if case.keys() != cases[0].keys()]
    hint = f"every case must name {names_of(paths)}"
    problems += [Problem(f"{where}[{i + 1}]", f"names {names_of(cases[i]) or 'nothing'}", hint) for i in odd[:MOST]]
    _end(problems, paths, where, len(odd[MOST:]))
    readers = [Reader(scene, p, f"{where}.{p}", problems) for p in paths]
    table = np.column_stack([[r.number(c[r.path]) for c in cases] for r in readers])
    _end(problems, paths, where, sum(r.untold for r in readers))
    return Cases(paths, tuple(r.unit for r in readers), len(cases), lambda start, stop: table[start:stop], ends=_ends(table.T))


def sampled(
    scene: Scene, ranges: Mapping[str, Any], count: int, seed: int = 0, method: str = "latin", where: str = "sample"
) -> Cases:
    """A sample of {path: (low, high), or a distribution such as "normal(0.3, 0.05)"}. The same seed gives the same cases.

    method: "latin" (one case in each of ``count`` strips of every range), "random" (independent cases), "sobol" (scrambled Sobol
    points, best for powers of 2) or "saltelli". "saltelli" crosses two Sobol samples of ``count`` points for Sobol indices: 2 ×
    paths + 2 cases for each point. SceneError lists every mistake."""
    few = method == "saltelli" and 1 <= count < LEAST_POINTS
    checks = (
        (count < 1, "count", f"{count} is not positive", "give a positive number of cases"),
        (seed < 0, "seed", f"{seed} is negative", "give a whole number from 0"),
        (method not in SAMPLINGS, "method", f"{method!r} is unknown", f"one of {', '.join(SAMPLINGS)}"),
        (few, "count", f"{count} points are too few for confidence intervals of the indices",
         f"give at least {LEAST_POINTS}; a few hundred are usual"),
        (method == "sobol" and count > 1 << BITS, "count", f"{count} exceeds the {1 << BITS} points of Sobol",
         "use latin or random"),
    )  # fmt: skip
    problems = [Problem(f"{where}.{field}", what, hint) for is_wrong, field, what, hint in checks if is_wrong]
    spreads, units = [], []
    for path, given in ranges.items():
        reader = Reader(scene, path, f"{where}.{path}", problems)
        spreads.append(spread_of(given, reader.number, reader.complain))
        units.append(reader.unit)
    _end(problems, ranges, where)

    def values(start: int, stop: int) -> np.ndarray:
        unit = points(count, len(spreads), seed, method, start, stop)
        return np.column_stack([inverse(unit[:, k]) for k, inverse in enumerate(spreads) if inverse is not None])

    ends = _ends([inverse(np.array([0.0, BELOW_ONE])) for inverse in spreads if inverse is not None])
    return Cases(tuple(ranges), tuple(units), count * width(method, len(spreads)), values, method, ends)


def ranges(
    scene: Scene, given: Mapping[str, Any], problems: list[Problem], where: str = "bounds"
) -> tuple[tuple[str, ...], np.ndarray, np.ndarray]:
    """(units, low, high) of the m ranges {path: (low, high)}. ``low`` and ``high`` have m numbers in SI units. Mistakes are
    appended to ``problems``."""
    units, ends = [], []
    for path, pair in given.items():
        reader = Reader(scene, path, f"{where}.{path}", problems)
        if isinstance(pair, str) or not isinstance(pair, Sequence) or len(pair) != 2:
            reader.complain("a range has two ends", "for example [0.1, 0.6]")
            pair = (0.0, 1.0)
        low, high = map(reader.number, pair)
        if low >= high:
            reader.complain(f"{pair[0]} is not below {pair[1]}", "give the low end first")
        units.append(reader.unit)
        ends.append((low, high))
    if not given:
        problems.append(Problem(where, "nothing varies", "name at least one path, such as joints.ball.friction.mu"))
    low_high = np.array(ends, float).reshape(-1, 2)
    return tuple(units), low_high[:, 0], low_high[:, 1]


def _end(problems: list[Problem], paths: Any, where: str, untold: int = 0) -> None:
    """Raise SceneError if there are problems. untold: number of further problems, which ``problems`` does not list."""
    if not paths and not problems:
        problems.append(Problem(where, "nothing varies", "name at least one path, such as joints.ball.friction.mu"))
    if problems:
        raise SceneError(problems, untold)


def _ends(values: Iterable[np.ndarray]) -> np.ndarray:
    """The least and the largest value of each path (2 × paths)."""
    return np.array([(v.min(), v.max()) for v in values]).T


def _axis(reader: Reader, given: Any) -> np.ndarray:
    """The values of one path of a grid, in SI units."""
    if isinstance(given, str) and ":" in given:
        return _span(reader, given)
    if isinstance(given, str):
        given = [part.strip() for part in given.split(",")]
    if isinstance(given, np.ndarray):
        given = given.ravel().tolist()
    if isinstance(given, Real) and not isinstance(given, bool):
        given = [given]
    if not isinstance(given, Sequence) or not len(given):
        reader.complain("has no values", 'give a list, or "first:last:count" such as "0.1:0.6:26"')
        return np.zeros(1)
    if len(given) > MOST_VALUES:
        reader.complain(f"lists {len(given)} values", f"at most {MOST_VALUES}")
        return np.zeros(1)
    return np.array([reader.number(v) for v in given])


def _span(reader: Reader, text: str) -> np.ndarray:
    """The values that a text ``first:last:count`` names, in SI units."""
    parts = [p.strip() for p in text.split(":")]
    if len(parts) != 3 or not parts[2].isascii() or not parts[2].isdigit():
        reader.complain(f"{text!r} is not first:last:count", 'such as "0.1:0.6:26" or "0 deg:90 deg:91"')
        return np.zeros(1)
    if not 1 <= int(parts[2][:12]) <= MOST_VALUES:
        reader.complain(f"{text!r} requests {parts[2][:12]} values", f"from 1 to {MOST_VALUES}")
        return np.zeros(1)
    return np.linspace(reader.number(parts[0]), reader.number(parts[1]), int(parts[2]))
