"""Bounds and priors of parameters. Both express what the user knows about the values before the measurement."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from trunnion.basics.errors import Problem, raise_problems
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.batch.cases.distributions import WRITTEN
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.findings.findings_and_paths import parse_path
from trunnion.scene.overrides import list_parameters
from trunnion.scene.queries.numbers_by_path import bound_of, order_of
from trunnion.scene.units.python_arguments import Amounts

PRIOR_FORMS = "normal(mean, deviation) or lognormal(mean, deviation)"
LEAST_POSITIVE = 1e-6
"""Lower bound of a parameter that must be positive, relative to the parameter's start value."""
RUN_SEPARATOR = " @ "
"""Separates path and run in the name of a parameter that has its own value in each run."""


@dataclass(frozen=True)
class Prior:
    """A normal or log-normal prior. mean, deviation: mean and standard deviation of the number itself. Both values refer to the
    number and not to its logarithm, even for a log-normal prior (as in ``lognormal`` of samples)."""

    kind: str
    mean: float
    deviation: float

    @property
    def scale(self) -> float:
        """Standard deviation of the number, or of its logarithm for a log-normal prior."""
        return self.deviation if self.kind == "normal" else math.sqrt(math.log(1.0 + (self.deviation / self.mean) ** 2))

    def residual(self, value: float) -> tuple[float, float]:
        """(distance of a value from the mean in standard deviations, derivative of this distance by the value)."""
        s = self.scale
        if self.kind == "normal":
            return (value - self.mean) / s, 1.0 / s
        value = max(value, 1e-300)
        return (math.log(value / self.mean) + 0.5 * s * s) / s, 1.0 / (s * value)


@dataclass(frozen=True)
class BoundsAndPriors:
    """Bounds and priors of m parameters. names: the parameters; low, high (m): the bounds; priors: {index of the parameter:
    prior}."""

    names: tuple[str, ...]
    low: np.ndarray
    high: np.ndarray
    priors: Mapping[int, Prior]


def read_bounds_and_priors(
    scene: Scene, names: Sequence[str], bounds: Mapping[str, Sequence[Any]] | None, priors: Mapping[str, str] | None
) -> BoundsAndPriors:
    """The bounds of the scene's numbers, narrowed by the given bounds, and the priors.

    An entry for a path applies to the values of this parameter in all runs. SceneError lists every problem.
    """
    numbers = list_parameters(scene)
    units, values = {p.path: p.unit for p in numbers}, {p.path: p.value for p in numbers}
    paths = [n.partition(RUN_SEPARATOR)[0] for n in names]
    own = [bound_of(parse_path(p) or ()) for p in paths]
    low = np.array([b.least + (LEAST_POSITIVE * abs(values[p]) if b.open else 0.0) for b, p in zip(own, paths, strict=True)])
    high = np.array([b.most for b in own])
    for i, path in enumerate(paths):
        for other, above in _comparisons(path, values):
            if other not in paths:
                low[i], high[i] = (max(low[i], values[other]), high[i]) if above else (low[i], min(high[i], values[other]))
    read = Amounts()
    found: dict[int, Prior] = {}
    for where, given in (("bounds", bounds or {}), ("priors", priors or {})):
        for path in given:
            if path not in names and path not in paths:
                read.problems.append(Problem(where, f"{path} is not a parameter of the fit", f"one of {', '.join(names)}"))
    for i, (name, path) in enumerate(zip(names, paths, strict=True)):
        if (ends := _given_for(bounds, name, path)) is not None:
            number = partial(read.number, where=f"bounds, {name}", unit=units[path])
            a, b = (x if x is None else number(x) for x in ends)
            low[i], high[i] = max(low[i], -math.inf if a is None else a), min(high[i], math.inf if b is None else b)
            if not low[i] < high[i]:
                read.problems.append(Problem(f"bounds, {name}", "no value lies between the bounds", f"the number {own[i].rule}"))
        if (text := _given_for(priors, name, path)) is not None and (prior := _read_prior(text, name, units[path], read)):
            found[i] = prior
    read.end()
    return BoundsAndPriors(tuple(names), low, high, found)


def _comparisons(path: str, values: Mapping[str, float]) -> list[tuple[str, bool]]:
    """Numbers of the same owner that must be above or below the number at ``path``: (path of the other number, whether the number
    at ``path`` is the upper one)."""
    parsed = parse_path(path) or ()
    out = []
    for other in values:
        place = parse_path(other) or ()
        if place[:-1] != parsed[:-1] or place == parsed:
            continue
        if (order := order_of(parsed)) and order.low == place[-1]:
            out.append((other, True))
        if (order := order_of(place)) and order.low == parsed[-1]:
            out.append((other, False))
    return out


def order_constraints(names: Sequence[str], scene: Scene) -> list[tuple[int, int]]:
    """Index pairs (low, high) of parameters: the second parameter must not be below the first."""
    values = {p.path: p.value for p in list_parameters(scene)}
    out = []
    for i, name in enumerate(names):
        path, sign, run = name.partition(RUN_SEPARATOR)
        lower = {f"{p}{sign}{run}" for p, above in _comparisons(path, values) if above}
        out += [(j, i) for j, n in enumerate(names) if n in lower]
    return out


def _given_for(given: Mapping[str, Any] | None, name: str, path: str) -> Any:
    return (given or {}).get(name, (given or {}).get(path))


def _read_prior(text: str, name: str, unit: str, read: Amounts) -> Prior | None:
    where = f"priors, {name}"
    written = WRITTEN.match(text) if isinstance(text, str) else None
    numbers = [x.strip() for x in written[2].split(",")] if written else []
    if written is None or written[1] not in ("normal", "lognormal") or len(numbers) != 2:
        read.problems.append(Problem(where, f"{text!r} is not a valid prior", PRIOR_FORMS))
        return None
    before = len(read.problems)
    mean, deviation = (read.number(x, where, unit) for x in numbers)
    if len(read.problems) == before and (deviation <= 0.0 or (written[1] == "lognormal" and mean <= 0.0)):
        what = f"{text}: the standard deviation, and the mean of a log-normal prior, must be positive"
        read.problems.append(Problem(where, what, PRIOR_FORMS))
    return Prior(written[1], mean, deviation) if len(read.problems) == before else None


def check_start(scene_values: np.ndarray, known_: BoundsAndPriors) -> None:
    """Raise SceneError if a start value is outside its bounds. scene_values: the m start values."""
    problems = [
        Problem("bounds", f"the start value {n} = {v:g} is outside the bounds", "change it in the scene (overrides)")
        for n, v, a, b in zip(known_.names, scene_values, known_.low, known_.high, strict=True) if not a <= v <= b
    ]  # fmt: skip
    raise_problems(problems)
