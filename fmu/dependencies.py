"""What an FMU declares of its outputs: on which variables they depend at once, and at the start. One that declares too little is
wrong; one that declares too much makes hosts see algebraic loops that are none."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from engine.kernel.columns import Column
from engine.kernel.dependence import Dependence
from engine.simulation.run import Model
from fmu.description import NUMBER, PARAMETER, START_Q, START_QD, Variable, followed

MOST = 250_000
"""Pairs of outputs and parameters that are declared; beyond, where the description would be the longest file, inputs only."""


@dataclass(frozen=True)
class Depends:
    """Of an output: places, from 1 and in order, of the variables it depends on at once, and at the start."""

    now: tuple[int, ...]
    start: tuple[int, ...]


class _Places:
    """Places of inputs, of the derivatives of those that motions follow, and of parameters in the list of variables."""

    def __init__(self, model: Model, listed: list[Variable], outputs: int):
        place = {v.name: i + 1 for i, v in enumerate(listed)}
        names, motions = list(model.system.inputs), followed(model)
        self.of = [[place[n]] + [place[f"inputs.{n}.{k}"] for k in ("rate", "acceleration") if n in motions] for n in names]
        self.followed = [i for i, n in enumerate(names) if n in motions]
        numbers = [place[v.name] for v in listed if v.role in (NUMBER, PARAMETER, START_Q, START_QD)]
        self.parameters = numbers if len(numbers) * outputs <= MOST else []

    def every(self) -> set[int]:
        """Places of all inputs."""
        return {p for each in self.of for p in each}

    def motions(self) -> set[int]:
        """Places of what motions follow: value and rate, which make the start; the acceleration acts as a force does."""
        return {p for i in self.followed for p in self.of[i][:2]}


def dependencies(model: Model, listed: list[Variable], known: list[Dependence] | None) -> list[Depends]:
    """What each output depends on. known: from the structure of the expressions; None: from what each column is a quantity of."""
    places = _Places(model, listed, len(model.columns))
    found: Sequence[Dependence | None] = known or [None] * len(model.columns)
    return [_of(c, k, places) for c, k in zip(model.columns, found, strict=True)]


def _of(c: Column, known: Dependence | None, places: _Places) -> Depends:
    q = c.quantity
    now = set() if q.runtime or not q.direct else places.every() if known is None or known.solved else _named(known, places)
    if q.integral or (known is not None and known.constant):
        return Depends(_sorted(now), ())
    start = places.every() if q.runtime else now | places.motions()
    return Depends(_sorted(now), _sorted([*start, *places.parameters]))


def _named(known: Dependence, places: _Places) -> set[int]:
    """Inputs that stand in the column itself: forces by their value; motions by their second derivative, as they go on smoothly."""
    forces = {p for i in known.values if i not in places.followed for p in places.of[i]}
    return forces | {p for i in known.seconds if i in places.followed for p in places.of[i]}


def _sorted(places: Iterable[int]) -> tuple[int, ...]:
    return tuple(sorted(set(places)))
