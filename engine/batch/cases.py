"""Which cases a batch has: a grid, a list, or a seeded sample of numbers of a scene. Any case can be had by its index alone,
and is the same everywhere."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from numbers import Real
from typing import Any

import numpy as np

from engine.basics.problems import MOST, Problem, SceneError
from engine.batch.evenly import REPLICATES, points, width
from engine.batch.spread import spread_of
from engine.scene.contexts import unit_of
from engine.scene.finding import parse_path
from engine.scene.model import Scene
from engine.scene.overrides import apply
from engine.scene.quantities import agree, parse_quantity
from engine.scene.suggest import listed as names_of
from engine.scene.suggest import shown
from engine.scene.units import UnitError

SAMPLINGS = ("latin", "random", "sobol", "saltelli")
LEAST_POINTS = 2 * REPLICATES
"""Of a crossed sample."""
MOST_VALUES = 1_000_000
"""Most values one axis may list."""
TOLD = 5
"""Wrong values of one path that are told; a grid's values are mostly wrong all in the same way."""


@dataclass(frozen=True)
class Cases:
    """The cases of a batch. paths: what varies; units: their SI units; count: how many cases; values(start, stop): the numbers
    of cases start … stop − 1 ((stop − start) × paths), SI; sampling: how they were sampled, "" when they were not."""

    paths: tuple[str, ...]
    units: tuple[str, ...]
    count: int
    values: Callable[[int, int], np.ndarray] = field(compare=False)
    sampling: str = ""

    def changes(self, index: int) -> dict[str, float]:
        """One case as overrides of the scene, {path: SI value}."""
        row = self.values(index, index + 1)[0]
        return dict(zip(self.paths, map(float, row), strict=True))


def grid(scene: Scene, over: Mapping[str, Any], where: str = "over") -> Cases:
    """Every combination of values, the last path varying fastest. over: for each path a list of values, or "first:last:count"
    (the ends with units). SceneError with every mistake."""
    problems: list[Problem] = []
    readers = [_Reader(scene, path, f"{where}.{path}", problems) for path in over]
    axes = [_axis(reader, given) for reader, given in zip(readers, over.values(), strict=True)]
    _end(problems, over, where, sum(r.untold for r in readers))
    shape = tuple(len(a) for a in axes)

    def values(start: int, stop: int) -> np.ndarray:
        places = np.unravel_index(np.arange(start, stop), shape)
        return np.column_stack([a[p] for a, p in zip(axes, places, strict=True)])

    return Cases(tuple(over), tuple(r.unit for r in readers), math.prod(shape), values)


def listed(scene: Scene, cases: Sequence[Mapping[str, Any]], where: str = "cases") -> Cases:
    """The cases as given, each {path: value}; all of them must name the same paths. SceneError with every mistake."""
    problems: list[Problem] = []
    paths = tuple(cases[0]) if cases else ()
    odd = [i for i, case in enumerate(cases) if case.keys() != cases[0].keys()]
    hint = f"every case names {names_of(paths)}"
    problems += [Problem(f"{where}[{i + 1}]", f"names {names_of(cases[i]) or 'nothing'}", hint) for i in odd[:MOST]]
    _end(problems, paths, where, len(odd[MOST:]))
    readers = [_Reader(scene, p, f"{where}.{p}", problems) for p in paths]
    table = np.column_stack([[r.number(c[r.path]) for c in cases] for r in readers])
    _end(problems, paths, where, sum(r.untold for r in readers))
    return Cases(paths, tuple(r.unit for r in readers), len(cases), lambda start, stop: table[start:stop])


def sampled(
    scene: Scene, ranges: Mapping[str, Any], count: int, seed: int = 0, method: str = "latin", where: str = "sample"
) -> Cases:
    """Cases spread over {path: (low, high), or a distribution such as "normal(0.3, 0.05)"}. method: "latin" (each range cut into
    ``count`` strips, one case in every strip), "random" (independent), "sobol" (Sobol's points, scrambled; best for powers of 2),
    or "saltelli" (``count`` points in two such samples, crossed: (2 × paths + 2) cases a point, of which Sobol indices are made).
    The same seed gives the same cases. SceneError with every mistake."""
    problems: list[Problem] = []
    if count < 1:
        problems.append(Problem(f"{where}.count", f"{count} cases are none", "give a positive number"))
    if seed < 0:
        problems.append(Problem(f"{where}.seed", f"{seed} is negative", "give a whole number from 0"))
    if method not in SAMPLINGS:
        problems.append(Problem(f"{where}.method", f"{method!r} is unknown", f"one of {', '.join(SAMPLINGS)}"))
    if method == "saltelli" and 1 <= count < LEAST_POINTS:
        what = f"{count} points are too few to tell how well indices are known"
        problems.append(Problem(f"{where}.count", what, f"at least {LEAST_POINTS}; some hundred are usual"))
    spreads, units = [], []
    for path, given in ranges.items():
        reader = _Reader(scene, path, f"{where}.{path}", problems)
        spreads.append(spread_of(given, reader.number, reader.complain))
        units.append(reader.unit)
    _end(problems, ranges, where)

    def values(start: int, stop: int) -> np.ndarray:
        unit = points(count, len(spreads), seed, method)[start:stop]
        return np.column_stack([inverse(unit[:, k]) for k, inverse in enumerate(spreads) if inverse is not None])

    return Cases(tuple(ranges), tuple(units), count * width(method, len(spreads)), values, method)


def _end(problems: list[Problem], paths: Any, where: str, untold: int = 0) -> None:
    """Raise SceneError with the listed problems, if there are any; ``untold``: how many more there are."""
    if not paths and not problems:
        problems.append(Problem(where, "nothing varies", "name at least one path, such as joints.ball.friction.mu"))
    if problems:
        raise SceneError(problems, untold)


def _axis(reader: _Reader, given: Any) -> np.ndarray:
    """The values of one path of a grid, SI."""
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


def _span(reader: _Reader, text: str) -> np.ndarray:
    """The values that ``first:last:count`` stands for, SI."""
    parts = [p.strip() for p in text.split(":")]
    if len(parts) != 3 or not parts[2].isascii() or not parts[2].isdigit():
        reader.complain(f"{text!r} is not first:last:count", 'such as "0.1:0.6:26" or "0 deg:90 deg:91"')
        return np.zeros(1)
    if not 1 <= int(parts[2][:12]) <= MOST_VALUES:
        reader.complain(f"{text!r} asks for {parts[2][:12]} values", f"from 1 to {MOST_VALUES}")
        return np.zeros(1)
    return np.linspace(reader.number(parts[0]), reader.number(parts[1]), int(parts[2]))


class _Reader:
    """Turns values as written for one path into SI numbers; mistakes go on the list, which keeps the first few of each path.

    The unit of the path is found out once, so that a million values do not build a million scenes.
    """

    def __init__(self, scene: Scene, path: str, where: str, problems: list[Problem]):
        self.scene, self.path, self.where, self.problems = scene, path, where, problems
        found = number_at(scene, path)
        self.unit = found[1] if found is not None else ""
        self.wrong = 0

    @property
    def untold(self) -> int:
        """How many mistakes are not on the list."""
        return max(0, self.wrong - TOLD)

    def complain(self, what: str, hint: str = "") -> None:
        """Put one more mistake on the list, or only count it."""
        self.wrong += 1
        if self.wrong <= TOLD:
            self.problems.append(Problem(self.where, what, hint))

    def number(self, value: Any) -> float:
        """SI value of one entry; plain numbers are SI already. A number that the scene refuses is no mistake here: its case
        will fail."""
        value = _plain(value)
        if isinstance(value, bool) or not isinstance(value, float | str):
            self.complain(f"{shown(value)} is not a number")
            return math.nan
        if isinstance(value, float) and not math.isfinite(value):
            self.complain("is not finite")
            return math.nan
        if not self.unit and self.wrong < TOLD:
            return self._first(value)
        return value if isinstance(value, float) else self._with_unit(value)

    def _with_unit(self, text: str) -> float:
        """SI value of a number with a unit that fits the path."""
        try:
            value = parse_quantity(text)
            agree(value, self.unit or "1")
        except UnitError as e:
            self.complain(e.what, e.hint)
            return math.nan
        return float(value)

    def _first(self, value: float | str) -> float:
        """The first value of a number that the scene does not give; building the scene with that value shows what it is."""
        try:
            found = number_at(apply(self.scene, {self.path: value}), self.path)
        except SceneError as e:
            for p in e.problems:
                self.complain(f"{p.where}: {p.what}" if p.where != self.path else p.what, p.hint)
            return math.nan
        if found is None:
            self.complain("is not a single number of the scene", "give the path of a number, such as joints.ball.friction.mu")
            return math.nan
        self.unit = found[1]
        return found[0]


def _plain(value: Any) -> Any:
    """A number, or a text that is one, as a float; anything else as it is."""
    if isinstance(value, bool) or not isinstance(value, Real | str):
        return value
    try:
        return float(value)
    except ValueError:
        return value
    except OverflowError:
        return math.inf


def number_at(scene: Scene, path: str) -> tuple[float, str] | None:
    """(value, unit) of a number of a scene; None when the path does not lead to one."""
    place = parse_path(path)
    node: Any = scene
    for i, key in enumerate(place or ()):
        if isinstance(node, float) and place is not None and place[i:] == (0,):
            place = place[:i]  # a joint with one coordinate may give a number for its list: then q[1] means that number
            break
        node = _part(node, key)
    return (float(node), unit_of(scene, place)) if place and isinstance(node, float) else None


def _part(node: Any, key: str | int) -> Any:
    """What a key or index of a part of a scene leads to; None where it leads nowhere."""
    if isinstance(key, int):
        return node[key] if isinstance(node, tuple) and key < len(node) else None
    if isinstance(node, dict):
        return node.get(key)
    return getattr(node, key, None) if is_dataclass(node) and key in {f.name for f in fields(node)} else None
