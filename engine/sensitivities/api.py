"""``sensitivity``: derivatives of outputs by parameters along a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from engine.basics.problems import Problem, SceneError, SimulationError
from engine.kernel.columns import Column
from engine.scene.model import Scene
from engine.sensitivities.march import EventShift, marched
from engine.sensitivities.record import record
from engine.sensitivities.signals import Signals
from engine.sensitivities.start import checked, start_of
from engine.sensitivities.unit import Unit
from engine.simulation.redundancy import redundancy
from engine.simulation.run import Model

NOT_SMOOTH = ("extra", "state", "residual")
"""Keys of columns that count or audit: they have no derivative."""


UNIQUE = 1e-6
"""Agreement of two choices of reactions, relative, that shows a column to be unique."""


@dataclass(frozen=True)
class Sensitivity:
    """Outputs and their derivatives at the sample times.

    time (n), s; names (c) and units of outputs; parameters (m); values n × c; derivatives n × c × m, in units of the output per
    unit of the parameter (SI); events: those whose time moves with the parameters, and by how much.
    """

    time: np.ndarray
    names: tuple[str, ...]
    units: tuple[str, ...]
    parameters: tuple[str, ...]
    values: np.ndarray
    derivatives: np.ndarray
    events: tuple[EventShift, ...]
    notes: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> np.ndarray:
        """An output over time."""
        return self.values[:, self.names.index(name)]

    def d(self, name: str, parameter: str) -> np.ndarray:
        """d(output)/d(parameter) over time."""
        return self.derivatives[:, self.names.index(name), self.parameters.index(parameter)]


def sensitivity(
    scene: Scene | str,
    parameters: Sequence[str],
    outputs: Sequence[str],
    until: float | None = None,
    every: float | None = None,
    rtol: float = 1e-9,
    overrides: Mapping[str, Any] | None = None,
) -> Sensitivity:
    """Differentiate a run by parameters of its scene, exactly along its steps and across its events.

    scene: a Scene, a file, or a bundled model's name. parameters: paths as for ``overrides``, one number each (start values too).
    outputs: patterns of columns. until, every: as for ``simulate`` (default 100 samples). rtol: of the run underneath; derivatives
    are about a hundred times less accurate. Raises SceneError for wrong input, SimulationError when the run does not reach its end.
    """
    from engine.scene import load_scene
    from engine.scene.overrides import apply

    loaded = load_scene(scene) if isinstance(scene, str) else scene
    loaded = apply(loaded, overrides) if overrides else loaded
    until = float(loaded.simulation.until if until is None else until)
    every = float(every or until / 100)
    _check_times(until, every)
    checked(loaded, parameters)
    model = Model(loaded, tuple(outputs))
    chosen = list(model.columns)
    _check_columns(model, chosen)
    start = start_of(model, loaded, parameters)
    count = max(1, round(until / every))
    samples = [every * k for k in range(count)] + [until]
    run = record(model, samples, rtol)
    if model.kernel.structure[3]:
        raise SimulationError("friction depends on reactions that redundant loops leave open: no derivative")
    unit = Unit(model, chosen)
    signals = Signals(model.built.numbers, len(model.system.inputs))
    values, derivatives, march = marched(unit, signals, start, run, model.built.numbers)
    _check_unique(model, chosen, values, run.rows[:, 1:])
    names, units = tuple(c.name for c in chosen), tuple(c.unit for c in chosen)
    events, notes = tuple(march.events), tuple(march.notes)
    return Sensitivity(np.array(samples), names, units, tuple(parameters), run.rows[:, 1:], derivatives, events, notes)


def _check_unique(model: Model, chosen: list[Column], values: np.ndarray, rows: np.ndarray) -> None:
    """Reactions that redundant loops leave open are a choice of the runtime's; where that choice shows in a column, it has no
    derivative."""
    open_joints = redundancy(model.block).joints
    problems = []
    for i, c in enumerate(chosen):
        if c.key[0] not in ("reaction", "contact") or c.key[1] not in open_joints:
            continue
        if np.abs(values[:, i] - rows[:, i]).max() > UNIQUE * np.abs(rows[:, i]).max():
            hint = "ask for motion, or make the mechanism statically determinate"
            problems.append(Problem("outputs", f"{c.name} is not unique: the loops are redundant", hint))
    if problems:
        raise SceneError(problems)


def _check_times(until: float, every: float) -> None:
    if not (until > 0 and 0 < every <= until):
        raise SceneError([Problem("every", f"{every:g} s is no spacing within {until:g} s", "0 < every <= until")])


def _check_columns(model: Model, chosen: list[Column]) -> None:
    problems = [
        Problem("outputs", f"{c.name} has no derivative", "it counts or audits; ask for motion, forces or energies")
        for c in chosen if c.key[0] in NOT_SMOOTH
    ]
    if not chosen:
        problems.append(Problem("outputs", "none is given", "see `trunnion check SCENE --outputs` for the names"))
    if problems:
        raise SceneError(problems)


__all__ = ["Sensitivity", "sensitivity"]
