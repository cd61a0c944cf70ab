"""``sensitivity``: derivatives of outputs by parameters along a run."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from trunnion.analysis.sensitivities.derivatives_at_one_state import SensitivityUnit
from trunnion.analysis.sensitivities.initial_data_derivatives import differentiate_start, parameter_lines, table_entries
from trunnion.analysis.sensitivities.request_checks import check_request
from trunnion.analysis.sensitivities.step_record import Tick, record_steps
from trunnion.analysis.sensitivities.variational_equation import EventShift, integrate_sensitivities
from trunnion.basics.errors import Problem, raise_problems
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.kernel.interface.output_columns import Column
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.findings.findings_and_paths import parse_path
from trunnion.scene.overrides import Given, scene_given
from trunnion.scene.queries.numbers_by_path import unit_of
from trunnion.scene.units.python_arguments import Amount, Names, names_given
from trunnion.simulation.execution.starts_at_cuts_and_points import build_with_starts
from trunnion.simulation.results.redundant_reactions import redundancy
from trunnion.simulation.run import Model
from trunnion.simulation.settings.run_settings import settings_given, with_setting_docs

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
        """The data of this object as plain lists and numbers for JSON."""
        return {
            "time": self.time.tolist(), "outputs": list(self.names), "units": list(self.units),
            "parameters": list(self.parameters), "parameter_units": list(self.parameter_units),
            "derivative_units": self.derivative_units(),
            "values": self.values.tolist(), "derivatives": self.derivatives.tolist(), "notes": list(self.notes),
            "events": [{"time": e.time, "joint": e.joint, "shift": e.shift.tolist()} for e in self.events],
        }  # fmt: skip


@with_setting_docs("trunnion.sensitivity")
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
    """Differentiate outputs of a run with respect to parameters, exactly along the run's steps and across its events.

    The relative error of the derivatives is about a hundred times that of the run.

    Args:
        scene: as for ``simulate``.
        parameters: paths of single numbers; start values are allowed.
        outputs: names or patterns of columns.
        overrides: changes of the scene for the whole analysis, {path: value}.
        tick: called at least once in 64 steps; any exception raised in ``tick`` ends the analysis.

    Returns:
        Outputs and derivatives at the sample times.

    Raises:
        SceneError: for wrong input.
        SimulationError: if the run does not reach its end or has no derivative.
    """
    loaded = scene_given(scene, overrides)
    asked = settings_given("trunnion.sensitivity", {"until": until, "every": every, "rtol": rtol})
    return DifferentiatedRuns(loaded, names_given(parameters), names_given(outputs), **asked)(loaded, tick or _continue)


class DifferentiatedRuns:
    """Runs with derivatives, of scenes that differ only in numbers. The runs share the model and its compiled derivative functions.
    scene: the first of these scenes; other arguments as for ``sensitivity``."""

    def __init__(
        self, scene: Scene, parameters: Sequence[str], outputs: Sequence[str], until: float | None, every: float | None,
        rtol: float | None,
    ):  # fmt: skip
        self.parameters, self.outputs = list(parameters), list(outputs)
        built = build_with_starts(scene)
        self.chosen, end, every, self.tolerance = check_request(scene, parameters, outputs, until, every, rtol, built)
        count = max(1, math.ceil(end / every - 1e-9))
        self.every, self.samples = every, np.array([every * k for k in range(count)] + [end])
        self.by = tuple(unit_of(scene, parse_path(p) or ()) for p in parameters)
        self.model = Model(scene, outputs, built=built)
        self._unit: SensitivityUnit | None = None
        self._entries: dict[str, int] | None = None

    def __call__(self, scene: Scene, tick: Tick) -> Sensitivity:
        """The derivatives along the run of a scene. Errors as for ``sensitivity``."""
        self._take(scene)
        model, chosen = self.model, self.chosen
        lines = parameter_lines(scene, self.parameters)
        if self._entries is None:
            self._entries = table_entries(model, lines)
        start = differentiate_start(model, lines, self._entries, tick)
        run = record_steps(model, self.samples, self.every, self.tolerance, tick)
        if self._unit is None:
            self._unit = SensitivityUnit(model, chosen)
        else:
            self._unit.prepare(np.array(model.built.parameters.values, float))
        values, derivatives, integrator = integrate_sensitivities(self._unit, model.block, start, run, tick)
        _check_unique(model, chosen, values, run.rows[:, 1:])
        names, units = tuple(c.name for c in chosen), tuple(c.unit for c in chosen)
        return Sensitivity(
            self.samples, names, units, tuple(self.parameters), self.by, run.rows[:, 1:], derivatives,
            tuple(integrator.events), tuple(integrator.notes),
        )  # fmt: skip

    def _take(self, scene: Scene) -> None:
        """Set the numbers of ``scene`` in the model."""
        model = self.model
        if scene is model.built.scene:
            return
        built = build_with_starts(scene)
        if built.system == model.system and built.parameters.paths == model.built.parameters.paths:
            model.built = built
        else:
            self.model, self._unit, self._entries = Model(scene, self.outputs), None, None


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
        difference, size = values[:, i] - rows[:, i], np.abs(rows[:, i]).max()
        if np.abs(difference).max() > UNIQUE * size:
            hint = "choose columns of the motion, or make the mechanism statically determinate"
            problems.append(Problem("outputs", f"{c.name} is not unique, because the loops have redundant constraints", hint))
    raise_problems(problems)
