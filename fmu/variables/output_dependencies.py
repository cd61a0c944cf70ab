"""The dependencies of outputs that the model description declares, during the run and at the start. A missing dependency is an
error. An unnecessary dependency makes hosts report algebraic loops that do not exist."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from trunnion.fmu.variables.input_sums import sources_of
from trunnion.fmu.variables.outputs_inputs_parameters import NUMBER, PARAMETER, START_Q, START_QD, Variable, followed
from trunnion.kernel.interface.output_columns import Column
from trunnion.simulation.run import Model

MOST = 250_000
"""Largest number of declared dependencies of outputs on parameters. An FMU with more such dependencies declares only the
dependencies on inputs, so that the description stays small."""


class ColumnDependence(NamedTuple):
    """Dependence of a column (``kernel.units.column_dependence``). constant: whether the column is constant. solved: whether it
    contains multipliers or accelerations. values: indices of the inputs whose value the column contains. seconds: indices of the
    inputs whose second derivative it contains."""

    constant: bool
    solved: bool
    values: list[int]
    seconds: list[int]


@dataclass(frozen=True)
class OutputDependencies:
    """The indices (from 1, sorted) of the variables on which an output depends. now: during the run. start: at the start."""

    now: tuple[int, ...]
    start: tuple[int, ...]


class _Places:
    """Indices in the list of variables. of: for each input, the index of the input. If a motion follows the input, the indices of
    its derivatives are added. An input that is a sum is replaced by its sources. parameters: indices of parameters on which outputs
    can depend."""

    def __init__(self, model: Model, listed: list[Variable], outputs: int):
        place = {v.name: i + 1 for i, v in enumerate(listed)}
        names, motions = list(model.system.inputs), followed(model)
        kinds = {n: [n] + [f"inputs.{n}.{k}" for k in ("rate", "acceleration") if n in motions] for n in names}
        self.of = [[sources_of(listed, place[k], outputs) for k in kinds[n]] for n in names]
        self.followed = [i for i, n in enumerate(names) if n in motions]
        numbers = [place[v.name] for v in listed if v.role in (NUMBER, PARAMETER, START_Q, START_QD)]
        self.parameters = numbers if len(numbers) * outputs <= MOST else []

    def every(self) -> set[int]:
        """The indices of all inputs and their derivatives."""
        return {p for each in self.of for kind in each for p in kind}

    def motions(self) -> set[int]:
        """The indices of the values and rates of inputs that motions follow. Start values depend on these values and rates.
        Accelerations of these inputs are not included, because accelerations act like forces."""
        return {p for i in self.followed for kind in self.of[i][:2] for p in kind}


def dependencies(model: Model, listed: list[Variable], known: list[ColumnDependence] | None) -> list[OutputDependencies]:
    """The dependencies of each output. known: dependencies from the structure of the expressions. With None, the quantity of each
    column determines its dependencies."""
    places = _Places(model, listed, len(model.columns))
    found: Sequence[ColumnDependence | None] = known or [None] * len(model.columns)
    return [_of(c, k, places) for c, k in zip(model.columns, found, strict=True)]


def _of(c: Column, known: ColumnDependence | None, places: _Places) -> OutputDependencies:
    q = c.quantity
    now = set() if q.runtime or not q.direct else places.every() if known is None or known.solved else _named(known, places)
    if q.integral or (known is not None and known.constant):
        return OutputDependencies(_sorted(now), ())
    start = places.every() if q.runtime else now | places.motions()
    return OutputDependencies(_sorted(now), _sorted([*start, *places.parameters]))


def _named(known: ColumnDependence, places: _Places) -> set[int]:
    """The indices of inputs in the expression of a column. An input of a force is included if its value occurs in the expression.
    An input that a motion follows is included if its second derivative occurs, because position and rate of the motion are
    continuous."""
    forces = {i for i in known.values if i not in places.followed}
    return {p for i in forces | {i for i in known.seconds if i in places.followed} for kind in places.of[i] for p in kind}


def _sorted(places: Iterable[int]) -> tuple[int, ...]:
    return tuple(sorted(set(places)))
