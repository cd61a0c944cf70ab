"""``sensitivity``: derivatives of outputs by parameters along a run."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from engine.basics.problems import Problem, SceneError, SimulationError
from engine.kernel.columns import Column
from engine.scene.given import Amount, Names, names_given
from engine.scene.overrides import Given, list_parameters, scene_given
from engine.sensitivities.asked import checked_request
from engine.sensitivities.march import EventShift, marched
from engine.sensitivities.record import Tick, record
from engine.sensitivities.start import start_of
from engine.sensitivities.unit import Unit
from engine.simulation.redundancy import redundancy
from engine.simulation.run import Model
from engine.simulation.settings import described, settings_given

UNIQUE = 1e-6
"""Agreement of two choices of reactions, relative, that shows a column to be unique."""


@dataclass(frozen=True)
class Sensitivity:
    """Outputs and their derivatives at the sample times.

    time (n), s; names (c) of the outputs, and their units; parameters (m), and their units; values (n × c); derivatives (n × c ×
    m), in units of the output per unit of the parameter (SI); events: those whose time moves with the parameters, and by how much.
    """

    time: np.ndarray
    names: tuple[str, ...]
    units: tuple[str, ...]
    parameters: tuple[str, ...]
    parameter_units: tuple[str, ...]
    values: np.ndarray
    derivatives: np.ndarray
    events: tuple[EventShift, ...]
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"<Sensitivity of {', '.join(self.names)} to {', '.join(self.parameters)}: {len(self.time)} times>"

    def __getitem__(self, name: str) -> np.ndarray:
        """An output over time (n)."""
        return self.values[:, self.names.index(name)]

    def d(self, name: str, parameter: str) -> np.ndarray:
        """Derivative of an output by a parameter over time (n)."""
        return self.derivatives[:, self.names.index(name), self.parameters.index(parameter)]

    def derivative_units(self) -> list[list[str]]:
        """Units of the derivatives, for every output one by every parameter."""
        return [[_per(u, p) for p in self.parameter_units] for u in self.units]

    def document(self) -> dict[str, Any]:
        """Everything as plain data, ready for JSON."""
        return {
            "time": self.time.tolist(), "outputs": list(self.names), "units": list(self.units),
            "parameters": list(self.parameters), "parameter_units": list(self.parameter_units),
            "derivative_units": self.derivative_units(),
            "values": self.values.tolist(), "derivatives": self.derivatives.tolist(), "notes": list(self.notes),
            "events": [{"time": e.time, "joint": e.joint, "shift": e.shift.tolist()} for e in self.events],
        }  # fmt: skip


@described("engine.sensitivity")
def sensitivity(
    scene: Given,
    parameters: Names,
    outputs: Names,
    until: Amount | None = None,
    every: Amount | None = None,
    rtol: Amount | None = None,
    overrides: Mapping[str, Any] | None = None,
    tick: Tick | None = None,
) -> Sensitivity:
    """Differentiate a run by parameters of its scene, exactly along its steps and across its events.

    scene: as for ``simulate``. parameters: paths as for ``overrides``, one number each (start values too).
    outputs: patterns of columns. rtol is that of the run underneath; derivatives are about a hundred times less accurate.
    tick: called at least once a step; what it raises ends the work. Raises SceneError for wrong input, SimulationError when the run
    does not reach its end.
    """
    loaded, tick = scene_given(scene, overrides), tick or _nothing
    parameters, outputs = names_given(parameters), names_given(outputs)
    asked = settings_given("engine.sensitivity", {"until": until, "every": every, "rtol": rtol})
    chosen, end, every, tolerance = checked_request(loaded, parameters, outputs, **asked)
    model = Model(loaded, outputs)
    start = start_of(model, loaded, parameters, tick)
    count = max(1, math.ceil(end / every - 1e-9))
    samples = [every * k for k in range(count)] + [end]
    run = record(model, samples, tolerance, tick)
    if model.kernel.structure[3]:
        raise SimulationError("friction depends on reactions that redundant loops leave open: no derivative")
    unit = Unit(model, chosen)
    values, derivatives, march = marched(unit, model.block, start, run, tick)
    _check_unique(model, chosen, values, run.rows[:, 1:])
    names, units = tuple(c.name for c in chosen), tuple(c.unit for c in chosen)
    events, notes = tuple(march.events), tuple(march.notes)
    known = {p.path: p.unit for p in list_parameters(loaded)}
    by = tuple(known[p] for p in parameters)
    return Sensitivity(np.array(samples), names, units, tuple(parameters), by, run.rows[:, 1:], derivatives, events, notes)


def _nothing() -> None:
    """The tick of a caller who gives none: it never ends the work."""


def _per(unit: str, by: str) -> str:
    """Unit of a derivative: N*m per kg/m^3 is N*m/(kg/m^3)."""
    if unit == by:
        return "1"
    return unit if by == "1" else f"{unit}/({by})" if set(by) & set("*/") else f"{unit}/{by}"


def _check_unique(model: Model, chosen: list[Column], values: np.ndarray, rows: np.ndarray) -> None:
    """SceneError when a chosen column shows reactions that redundant loops leave open: these are a choice of the runtime's, and
    a choice has no derivative."""
    open_joints = redundancy(model.block).joints
    problems = []
    for i, c in enumerate(chosen):
        if not c.quantity.reacts or c.key[1] not in open_joints:
            continue
        if np.abs(values[:, i] - rows[:, i]).max() > UNIQUE * np.abs(rows[:, i]).max():
            hint = "ask for motion, or make the mechanism statically determinate"
            problems.append(Problem("outputs", f"{c.name} is not unique: the loops are redundant", hint))
    if problems:
        raise SceneError(problems)


__all__ = ["Sensitivity", "sensitivity"]
