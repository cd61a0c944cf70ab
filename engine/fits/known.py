"""What is known of parameters before anything is measured: bounds, and normal or log-normal priors."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from engine.basics.problems import Problem, SceneError
from engine.batch.spread import WRITTEN
from engine.scene.contexts import bound_of, order_of
from engine.scene.finding import parse_path
from engine.scene.given import Amounts
from engine.scene.model import Scene
from engine.scene.overrides import list_parameters

FORMS = "normal(mean, deviation) or lognormal(mean, deviation)"
LEAST = 1e-6
"""Of its start value: how near a number that has to be positive may come to zero."""
OF_RUN = " @ "
"""Between a path and the run that has a value of its own for it, in the name of a parameter."""


@dataclass(frozen=True)
class Prior:
    """Belief about a number before the measurement; mean and deviation are those of the number itself, of the log-normal one too
    (as in samples). Its penalty is the square of ``miss``."""

    kind: str
    mean: float
    deviation: float

    @property
    def spread(self) -> float:
        """Standard deviation of the number, of a log-normal one of its logarithm."""
        return self.deviation if self.kind == "normal" else math.sqrt(math.log(1.0 + (self.deviation / self.mean) ** 2))

    def miss(self, value: float) -> tuple[float, float]:
        """(how far a value is off, in standard deviations; the derivative of this by the value)."""
        s = self.spread
        if self.kind == "normal":
            return (value - self.mean) / s, 1.0 / s
        value = max(value, 1e-300)
        return (math.log(value / self.mean) + 0.5 * s * s) / s, 1.0 / (s * value)


@dataclass(frozen=True)
class Known:
    """names (m) of the parameters; low, high (m): where they may lie; priors: by the parameter's place."""

    names: tuple[str, ...]
    low: np.ndarray
    high: np.ndarray
    priors: Mapping[int, Prior]


def known(
    scene: Scene, names: Sequence[str], bounds: Mapping[str, Sequence[Any]] | None, priors: Mapping[str, str] | None
) -> Known:
    """What is known of the parameters ``names``: the bounds of the scene's numbers, narrowed by those given, and the priors. What
    is given for a path holds for it in every run. SceneError with everything that is wrong."""
    numbers = list_parameters(scene)
    units, values = {p.path: p.unit for p in numbers}, {p.path: p.value for p in numbers}
    paths = [n.partition(OF_RUN)[0] for n in names]
    own = [bound_of(parse_path(p) or ()) for p in paths]
    low = np.array([b.least + (LEAST * abs(values[p]) if b.open else 0.0) for b, p in zip(own, paths, strict=True)])
    high = np.array([b.most for b in own])
    for i, path in enumerate(paths):
        for other, above in _ordered(path, values):
            if other not in paths:
                low[i], high[i] = (max(low[i], values[other]), high[i]) if above else (low[i], min(high[i], values[other]))
    read = Amounts()
    found: dict[int, Prior] = {}
    for where, given in (("bounds", bounds or {}), ("priors", priors or {})):
        for path in given:
            if path not in names and path not in paths:
                read.problems.append(Problem(where, f"{path} is no parameter of the fit", f"one of {', '.join(names)}"))
    for i, (name, path) in enumerate(zip(names, paths, strict=True)):
        if (ends := _of(bounds, name, path)) is not None:
            number = partial(read.number, where=f"bounds, {name}", unit=units[path])
            a, b = (x if x is None else number(x) for x in ends)
            low[i], high[i] = max(low[i], -math.inf if a is None else a), min(high[i], math.inf if b is None else b)
            if not low[i] < high[i]:
                read.problems.append(Problem(f"bounds, {name}", "no value lies between them", f"the number {own[i].rule}"))
        if (text := _of(priors, name, path)) is not None and (prior := _prior(text, name, units[path], read)):
            found[i] = prior
    read.end()
    return Known(tuple(names), low, high, found)


def _ordered(path: str, values: Mapping[str, float]) -> list[tuple[str, bool]]:
    """(path of a number of the same owner, whether this one must not be below it; else above) of every comparison that a number
    takes part in."""
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


def ordered(names: Sequence[str], scene: Scene) -> list[tuple[int, int]]:
    """Places of the pairs of parameters, low and high, of which the second must not be below the first."""
    values = {p.path: p.value for p in list_parameters(scene)}
    out = []
    for i, name in enumerate(names):
        path, sign, run = name.partition(OF_RUN)
        lower = {f"{p}{sign}{run}" for p, above in _ordered(path, values) if above}
        out += [(j, i) for j, n in enumerate(names) if n in lower]
    return out


def _of(given: Mapping[str, Any] | None, name: str, path: str) -> Any:
    return (given or {}).get(name, (given or {}).get(path))


def _prior(text: str, name: str, unit: str, read: Amounts) -> Prior | None:
    where = f"priors, {name}"
    written = WRITTEN.match(text) if isinstance(text, str) else None
    numbers = [x.strip() for x in written[2].split(",")] if written else []
    if written is None or written[1] not in ("normal", "lognormal") or len(numbers) != 2:
        read.problems.append(Problem(where, f"{text!r} is no prior", FORMS))
        return None
    before = len(read.problems)
    mean, deviation = (read.number(x, where, unit) for x in numbers)
    if len(read.problems) == before and (deviation <= 0.0 or (written[1] == "lognormal" and mean <= 0.0)):
        read.problems.append(Problem(where, f"{text}: the standard deviation must be positive, a log-normal mean too", FORMS))
    return Prior(written[1], mean, deviation) if len(read.problems) == before else None


def inside(scene_values: np.ndarray, known_: Known) -> None:
    """SceneError when a search would start outside the bounds."""
    problems = [
        Problem("bounds", f"{n} = {v:g}, with which the search starts, is outside", "start inside: set it in the scene (overrides)")
        for n, v, a, b in zip(known_.names, scene_values, known_.low, known_.high, strict=True) if not a <= v <= b
    ]  # fmt: skip
    if problems:
        raise SceneError(problems)
