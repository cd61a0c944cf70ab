"""Derivatives of a run's initial data by a scene's parameters. The initial data are run-time parameters, the start state, and times
of kinks in signals.

The initial data are algebraic functions of the parameters (mass from density, loop assembly). Finite differences of order six with
a relative step of a hundredth give their derivatives to about 1e-12. Finite differences are never applied to the trajectory itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress

import numpy as np

from trunnion.analysis.sensitivities.step_record import Tick
from trunnion.basics.errors import Problem, SceneError, raise_problems
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.basics.number_declarations import ANY
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.expressions.parameter_dependence import DependentNumbers, parameter
from trunnion.scene.findings.findings_and_paths import parse_path
from trunnion.scene.findings.name_suggestions import closest
from trunnion.scene.overrides import apply, list_parameters
from trunnion.scene.queries.numbers_by_path import bound_of, number_at
from trunnion.simulation.execution.starts_at_cuts_and_points import build_with_starts
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface.simulation_block import Settings
from trunnion.system.construction.start_values_and_scales import Numbers
from trunnion.system.construction.system_builder import Built
from trunnion.system.signals.signal_tables import table_block

STEP = 1e-2
LINEAR = 16.0 * np.finfo(float).eps
"""Largest deviation from linearity, relative to a number, that counts as round-off."""
CENTRAL = ((-3, -1 / 60), (-2, 3 / 20), (-1, -3 / 4), (1, 3 / 4), (2, -3 / 20), (3, 1 / 60))
FORWARD = ((0, -49 / 20), (1, 6.0), (2, -15 / 2), (3, 20 / 3), (4, -15 / 4), (5, 6 / 5), (6, -1 / 6))
BACKWARD = tuple((-k, -w) for k, w in FORWARD)
Weights = Sequence[tuple[int, float]]
"""(offset, weight) pairs of finite differences of order six for a first derivative, at unit spacing. FORWARD is for a parameter at
its lower bound, BACKWARD for a parameter at its upper bound."""


@dataclass(frozen=True)
class InitialDerivatives:
    """Derivatives of a run's initial data by m parameters.

    Attributes:
        p: derivatives of the run-time parameters, then of the external inputs (np × m).
        y: derivatives of the start state (ny × m).
        breaks: derivatives of the times and periods of kinks in signals (kinks × 2 × m).
        magnitudes: magnitudes of the parameters (m).
    """

    p: np.ndarray
    y: np.ndarray
    breaks: np.ndarray
    magnitudes: np.ndarray


def parameter_values(scene: Scene, parameters: Sequence[str]) -> list[float]:
    """Values of the parameters, SI units. SceneError names every path that is not a single number of the scene."""
    raise_problems(parameter_problems(scene, parameters))
    return [_value(scene, n) for n in parameters]


def _value(scene: Scene, name: str) -> float:
    """The number at a path that ``parameter_problems`` accepts."""
    found = _number(scene, name)
    assert found is not None
    return found


def _number(scene: Scene, name: str) -> float | None:
    return number_at(scene, path) if (path := parse_path(name)) else None


def parameter_problems(scene: Scene, parameters: Sequence[str]) -> list[Problem]:
    """A problem for every path that is not a number of the scene, or with respect to which a run has no derivative."""
    following = _following(scene, parameters)
    problems = []
    for name in parameters:
        known = _number(scene, name) is not None
        if not known:
            every = [p.path for p in list_parameters(scene)]
            near = next((k for k in every if k.startswith(f"{name}[")), None) or closest(name, every)
            hint = f'did you mean "{near}"?' if near else "use the paths of --set, each of a single number"
            problems.append(Problem("parameters", f"{name!r} is not a number of the scene", hint))
        for path in dependent_paths(following, name) if known else ():
            in_table = "table" in (parse_path(path) or ())[2:]  # skip the second key, a name that may be "table"
            if path.startswith("simulation.") or in_table:
                what = "a table" if in_table else "a setting of the run"
                said = f"{name} belongs to {what}" if path == name else f"{name} acts on {path}, {what}"
                problems.append(Problem("parameters", said, "choose a number of the mechanism"))
    if not parameters:
        problems.append(Problem("parameters", "no parameter is given", "for example joints.ball.friction.mu"))
    return problems


def dependent_paths(following: DependentNumbers | None, name: str) -> list[str]:
    """Paths of the scene's numbers that depend on ``name``. For a number, this is its own path; for a parameter, all numbers whose
    expressions depend on the parameter. following: the result of ``_following``."""
    return following.of([parameter(name)]) if following and parameter(name) else [name]


def _following(scene: Scene, names: Sequence[str]) -> DependentNumbers | None:
    """The numbers of the scene that depend on its parameters; None if no name is that of a parameter."""
    return DependentNumbers(scene) if any(map(parameter, names)) else None


def differentiate_start(
    model: Model, lines: Sequence[ParameterLine], entries: Mapping[str, int], tick: Tick
) -> InitialDerivatives:
    """Derivatives of the initial data by the numbers of ``lines``. entries: the result of ``table_entries``. Afterwards the block
    is assembled again with the scene's own values."""
    columns = []
    for line in lines:
        tick()
        columns.append(_by_entry(model, line, entries[line.name]) if line.name in entries else _differentiate(model, line))
    _start_numbers(model, model.built)
    p, y, breaks = (np.stack([c[k] for c in columns], axis=-1) for k in range(3))
    return InitialDerivatives(p, y, breaks, np.array([line.size for line in lines]))


def parameter_lines(scene: Scene, parameters: Sequence[str]) -> list[ParameterLine]:
    """A line for each of these parameters. ``parameter_problems`` must find no problems in them."""
    following = _following(scene, parameters)
    return [ParameterLine(scene, name, following) for name in parameters]


class ParameterLine:
    """Scenes in which one number varies. Numbers that depend on this number by expressions vary linearly, with their exact slopes.
    following: the result of ``_following``. size: scale of the finite-difference steps."""

    def __init__(self, scene: Scene, name: str, following: DependentNumbers | None):
        value = _value(scene, name)
        self.scene, self.name, self.value = scene, name, value
        by = following.slopes(parameter(name)) if following and parameter(name) else {name: 1.0}
        self.moves = {path: (_value(scene, path), slope) for path, slope in by.items()}
        reach = [_step_limit(path, v, s, _parameter_size(value)) for path, (v, s) in self.moves.items() if s]
        self.size = min(_parameter_size(value), *reach) if parameter(name) and reach else _parameter_size(value)

    def at(self, step: float) -> Scene:
        """The scene with the number changed by ``step``."""
        return apply(self.scene, {path: v + step * slope for path, (v, slope) in self.moves.items()})


def _step_limit(path: str, value: float, slope: float, size: float) -> float:
    """Largest change of a parameter that changes a dependent number at ``path`` by at most this number's magnitude.

    value: the dependent number; slope: its derivative by the parameter; size: magnitude of the parameter. A dependent number
    without bounds may be small by chance. Its magnitude is therefore taken as at least a tenth of the change that ``size`` causes.
    """
    free = bound_of(parse_path(path) or ()) == ANY
    return max(abs(value), 0.1 * abs(slope) * size if free else 0.0) / abs(slope) if value else size


def _parameter_size(value: float) -> float:
    return abs(value) if value else 0.1


def _differentiate(model: Model, line: ParameterLine) -> tuple[np.ndarray, ...]:
    h = STEP * line.size
    for weights in (CENTRAL, FORWARD):
        with suppress(SceneError):
            return _linear(model, line, h) or _differences(model, line, h, weights)
    return _differences(model, line, h, BACKWARD)


def _linear(model: Model, line: ParameterLine, h: float) -> tuple[np.ndarray, ...] | None:
    """The result of ``_differentiate`` for initial data that depend linearly on the number, up to round-off. Two other scenes, at
    unequal distances on both sides, test the linearity: nonlinear terms could cancel in both scenes only by chance. None if some of
    the data are not linear."""
    scenes = _neighbour(model, line, -2 * h), model.built, _neighbour(model, line, 3 * h)
    low, own, high = (_start_numbers(model, built) for built in scenes)
    for a, b, c in zip(low, own, high, strict=True):
        if np.any(np.abs(2.0 * (c - b) - 3.0 * (b - a)) > LINEAR * np.maximum(np.abs(a), np.abs(c))):
            return None
    return tuple((c - a) / (5.0 * h) for a, c in zip(low, high, strict=True))


def _differences(model: Model, line: ParameterLine, h: float, weights: Weights) -> tuple[np.ndarray, ...]:
    return _weighted(h, weights, [_start_numbers(model, _neighbour(model, line, k * h)) for k, _ in weights])


def table_entries(model: Model, lines: Sequence[ParameterLine]) -> dict[str, int]:
    """Index in the table of parameters of every number that is an entry of the table and changes nothing else of the scene. The
    function tests all these numbers together with one other scene, in which they all differ. If this test fails, the function tests
    each number with a separate scene."""
    places = {line.name: model.built.parameters.place(line.name) for line in lines}
    tried = [line for line in lines if places[line.name] is not None]
    found = {line.name: place for line in tried if (place := places[line.name]) is not None}
    if not tried or _are_entries(model, tried, found):
        return found
    return {line.name: found[line.name] for line in tried if len(tried) > 1 and _are_entries(model, [line], found)}


def _are_entries(model: Model, lines: Sequence[ParameterLine], places: Mapping[str, int]) -> bool:
    """Whether a scene with other numbers differs from the given scene only in these entries of the table, and these entries equal
    the numbers."""
    own = model.built
    for sense in (1.0, -1.0):
        values = {line.name: line.value + sense * STEP * line.size for line in lines}
        with suppress(SceneError):
            moved = build_with_starts(apply(lines[0].scene, values))
            if moved.parameters.paths != own.parameters.paths or moved.system != own.system:
                return False
            expected = np.array(own.parameters.values, float)
            expected[[places[name] for name in values]] = list(values.values())
            same = zip(_given_numbers(own.numbers), _given_numbers(moved.numbers), strict=True)
            return np.array_equal(expected, moved.parameters.values) and all(np.array_equal(a, b) for a, b in same)
    return False


def _by_entry(model: Model, line: ParameterLine, place: int) -> tuple[np.ndarray, ...]:
    """The result of ``_differentiate`` for a number that is an entry of the table. The entry has the derivative 1; finite
    differences are needed only for the assembly of loops."""
    numbers, p = model.built.numbers, np.array(model.built.parameters.values, float)
    dp, y, breaks = np.zeros(len(p) + len(numbers.inputs)), np.zeros(model.block.ny), np.zeros((len(numbers.breaks), 2))
    dp[place] = 1.0
    if not model.system.rows:
        return dp, y, breaks
    found, h = [], STEP * line.size
    for k, _ in CENTRAL:
        p[place] = line.value + k * h
        found.append((_assembled(model, numbers, p),))
    return dp, *_weighted(h, CENTRAL, found), breaks


def _neighbour(model: Model, line: ParameterLine, step: float) -> Built:
    """The scene with the number changed by ``step``. Raises SceneError if the structure of this scene differs."""
    built = build_with_starts(line.at(step))
    if built.parameters.paths != model.built.parameters.paths or built.system != model.built.system:
        raise SceneError([_structural_problem(line)])
    return built


def _given_numbers(n: Numbers) -> tuple[np.ndarray, ...]:
    """The numbers of a scene besides its parameters that determine the start and the signals of a run."""
    given = (n.q, n.v, n.q_given_by_rate, n.v_given, n.inputs, n.breaks, table_block(n.tables))
    return tuple(np.array(a, float) for a in given)


def _weighted(h: float, weights: Weights, found: Sequence[tuple[np.ndarray, ...]]) -> tuple[np.ndarray, ...]:
    """The finite difference of each array in ``found``."""
    return tuple(sum(w / h * a for (_, w), a in zip(weights, each, strict=True)) for each in zip(*found, strict=True))


def _structural_problem(line: ParameterLine) -> Problem:
    """The problem of a number whose change alters the structure, such as a number that is zero in the scene."""
    zero = [path for path, (v, slope) in line.moves.items() if not v and slope]
    if not parameter(line.name):
        zero = [line.name]
    if not zero:
        return Problem(
            "parameters",
            f"{line.name} changes the structure of the scene",
            "axes and orientations of bodies belong to the structure",
        )
    what = f"{', '.join(zero)} is zero in the scene, and therefore belongs to its structure"
    return Problem("parameters", what, f'add "{zero[0]}" to the scene\'s tunable list')


def _start_numbers(model: Model, built: Built) -> tuple[np.ndarray, ...]:
    """Initial data of a scene of the same structure: (run-time parameters and inputs, assembled state, times of kinks)."""
    p = np.array(built.parameters.values, float)
    y = _assembled(model, built.numbers, p)
    return np.concatenate([p, built.numbers.inputs]), y, np.array(built.numbers.breaks, float).reshape(-1, 2)


def _assembled(model: Model, numbers: Numbers, p: np.ndarray) -> np.ndarray:
    """The assembled start state with the run-time parameters p."""
    block = model.block
    block.take(numbers, p)
    block.configure(Settings())
    if block.assemble() != 1:
        raise SceneError(
            [Problem("parameters", "the loops do not close at neighbouring parameter values", "start further from the dead centre")]
        )
    return block.y[: block.ny].copy()
