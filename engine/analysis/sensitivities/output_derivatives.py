"""``sensitivity``: derivatives of outputs by parameters along a run."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from trunnion.analysis.sensitivities.directional_derivatives import SensitivityUnit
from trunnion.analysis.sensitivities.initial_derivatives import differentiate_start
from trunnion.analysis.sensitivities.request_checks import check_request
from trunnion.analysis.sensitivities.step_record import Tick, record_steps
from trunnion.analysis.sensitivities.variational_equation import EventShift, integrate_sensitivities
from trunnion.basics.problems import Problem, SceneError, SimulationError
from trunnion.kernel.interface.output_columns import Column
from trunnion.scene.overrides import Given, list_parameters, scene_given
from trunnion.scene.units.python_arguments import Amount, Names, names_given
from trunnion.simulation.results.redundant_reactions import redundancy
from trunnion.simulation.run import Model
from trunnion.simulation.settings.run_settings import described, settings_given

UNIQUE = 1e-6
"""A column counts as unique if its values for two different solutions for the reactions agree to this relative tolerance."""


@dataclass(frozen=True)
class Sensitivity:
    """Outputs and their derivatives at the sample times, in SI units.

    Attributes:
        time: the n sample times, s.
        names: names of the c outputs.
        units: units of the c outputs.
        parameters: paths of the m parameters.
        parameter_units: units of the m parameters.
        values: outputs (n × c).
        derivatives: derivatives of the outputs by the parameters (n × c × m), output unit per parameter unit.
        events: events whose times depend on the parameters, with the derivatives of these times.
        notes: notes on events of unknown cause; derivatives after such an event are not reliable.
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
        """Values of an output over time (n)."""
        return self.values[:, self.names.index(name)]

    def d(self, name: str, parameter: str) -> np.ndarray:
        """Derivative of an output by a parameter over time (n)."""
        return self.derivatives[:, self.names.index(name), self.parameters.index(parameter)]

    def derivative_units(self) -> list[list[str]]:
        """Units of the derivatives, outputs × parameters."""
        return [[_derivative_unit(u, p) for p in self.parameter_units] for u in self.units]

    def document(self) -> dict[str, Any]:
        """The same data as plain lists and numbers for JSON."""
        return {
            "time": self.time.tolist(), "outputs": list(self.names), "units": list(self.units),
            "parameters": list(self.parameters), "parameter_units": list(self.parameter_units),
            "derivative_units": self.derivative_units(),
            "values": self.values.tolist(), "derivatives": self.derivatives.tolist(), "notes": list(self.notes),
            "events": [{"time": e.time, "joint": e.joint, "shift": e.shift.tolist()} for e in self.events],
        }  # fmt: skip


@described("trunnion.sensitivity")
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
    """Differentiate outputs of a run by parameters of its scene, exactly along the run's steps and across its events.

    The relative error of the derivatives is about a hundred times that of the run.

    Args:
        scene: as for ``simulate``.
        parameters: paths of single numbers; start values are allowed.
        outputs: names or patterns of columns.
        overrides: changes of the scene for the whole analysis, {path: value}.
        tick: called at least once a step; any exception raised in ``tick`` ends the analysis.

    Returns:
        Outputs and derivatives at the sample times.

    Raises:
        SceneError: for wrong input.
        SimulationError: if the run does not reach its end or has no derivative.
    """
    loaded, tick = scene_given(scene, overrides), tick or _continue
    parameters, outputs = names_given(parameters), names_given(outputs)
    asked = settings_given("trunnion.sensitivity", {"until": until, "every": every, "rtol": rtol})
    chosen, end, every, tolerance = check_request(loaded, parameters, outputs, **asked)
    model = Model(loaded, outputs)
    start = differentiate_start(model, loaded, parameters, tick)
    count = max(1, math.ceil(end / every - 1e-9))
    samples = [every * k for k in range(count)] + [end]
    run = record_steps(model, samples, tolerance, tick)
    if model.kernel.structure[3]:
        raise SimulationError("no derivative: friction depends on reactions that redundant constraints do not determine")
    unit = SensitivityUnit(model, chosen)
    values, derivatives, integrator = integrate_sensitivities(unit, model.block, start, run, tick)
    _check_unique(model, chosen, values, run.rows[:, 1:])
    names, units = tuple(c.name for c in chosen), tuple(c.unit for c in chosen)
    events, notes = tuple(integrator.events), tuple(integrator.notes)
    known = {p.path: p.unit for p in list_parameters(loaded)}
    by = tuple(known[p] for p in parameters)
    return Sensitivity(np.array(samples), names, units, tuple(parameters), by, run.rows[:, 1:], derivatives, events, notes)


def _continue() -> None:
    """The default tick: does nothing."""


def _derivative_unit(unit: str, by: str) -> str:
    """Unit of a derivative, such as N*m/(kg/m^3)."""
    if unit == by:
        return "1"
    return unit if by == "1" else f"{unit}/({by})" if set(by) & set("*/") else f"{unit}/{by}"


def _check_unique(model: Model, chosen: list[Column], values: np.ndarray, rows: np.ndarray) -> None:
    """Raise SceneError if redundant constraints leave the reactions in a chosen column undetermined. The runtime then reports one
    solution of many, which has no derivative."""
    open_joints = redundancy(model.block).joints
    problems = []
    for i, c in enumerate(chosen):
        if not c.quantity.reacts or c.key[1] not in open_joints:
            continue
        if np.abs(values[:, i] - rows[:, i]).max() > UNIQUE * np.abs(rows[:, i]).max():
            hint = "choose columns of the motion, or make the mechanism statically determinate"
            problems.append(Problem("outputs", f"{c.name} is not unique, because the loops have redundant constraints", hint))
    if problems:
        raise SceneError(problems)
