"""How the numbers a run starts from depend on a scene's parameters: run-time numbers, start state, times of kinks in signals.

These are algebraic (mass from density, points relative to joints, closing of loops), so that differences of order six at steps of a
hundredth are exact to about 1e-12; the trajectory itself is never differenced.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from engine.basics.numbers import ANY
from engine.basics.problems import Problem, SceneError
from engine.scene.contexts import bound_of
from engine.scene.finding import parse_path
from engine.scene.following import Following, parameter
from engine.scene.model import Scene
from engine.scene.overrides import apply, list_parameters
from engine.scene.suggest import closest
from engine.sensitivities.record import Tick
from engine.simulation.block import Settings
from engine.simulation.run import Model
from engine.system.build import Built, build

STEP = 1e-2
CENTRAL = ((-3, -1 / 60), (-2, 3 / 20), (-1, -3 / 4), (1, 3 / 4), (2, -3 / 20), (3, 1 / 60))
FORWARD = ((0, -49 / 20), (1, 6.0), (2, -15 / 2), (3, 20 / 3), (4, -15 / 4), (5, 6 / 5), (6, -1 / 6))
BACKWARD = tuple((-k, -w) for k, w in FORWARD)
"""(place, weight) of differences of order six for first derivatives at unit spacing; FORWARD for numbers that cannot go lower,
BACKWARD for those that cannot go higher."""


@dataclass(frozen=True)
class Start:
    """Derivatives by the parameters (a column each) of p: the run-time numbers, then the values of external inputs; of y: the
    start state; and of breaks: the times of kinks."""

    p: np.ndarray
    y: np.ndarray
    breaks: np.ndarray


def checked(scene: Scene, parameters: Sequence[str]) -> list[float]:
    """Values of the parameters at these paths; SceneError that names every path that is no single number of the scene."""
    if problems := parameter_problems(scene, parameters):
        raise SceneError(problems)
    known = {p.path: p.value for p in list_parameters(scene)}
    return [known[n] for n in parameters]


def parameter_problems(scene: Scene, parameters: Sequence[str]) -> list[Problem]:
    """A problem for every path that is no number a derivative may be taken by."""
    known = {p.path: p.value for p in list_parameters(scene)}
    following = Following(scene)
    problems = []
    for name in parameters:
        if name not in known:
            near = next((k for k in known if k.startswith(f"{name}[")), None) or closest(name, list(known))
            hint = f'did you mean "{near}"?' if near else "paths are those of --set, one number each"
            problems.append(Problem("parameters", f"{name!r} is no number of the scene", hint))
        for path in moved(following, name) if name in known else ():
            if path.startswith("simulation.") or ".table." in path:
                what = "a table" if ".table." in path else "a setting of the run"
                said = f"{name} belongs to {what}" if path == name else f"{name} acts on {path}, {what}"
                problems.append(Problem("parameters", said, "choose a number of the mechanism"))
    if not parameters:
        problems.append(Problem("parameters", "none is given", "for example joints.ball.friction.mu"))
    return problems


def moved(following: Following, name: str) -> list[str]:
    """Paths of the scene's own numbers that a number moves: itself, or what follows it where it is a parameter."""
    return following.of([parameter(name)]) if parameter(name) else [name]


def start_of(model: Model, scene: Scene, parameters: Sequence[str], tick: Tick) -> Start:
    """Derivatives of what the run starts from. The block is left assembled at the scene's own numbers."""
    values = checked(scene, parameters)
    following = Following(scene)
    columns = []
    for name, value in zip(parameters, values, strict=True):
        tick()
        columns.append(_column(model, _Line(scene, name, value, following)))
    _numbers(model, model.built)
    return Start(*(np.column_stack([c[k] for c in columns]) for k in range(3)))


class _Line:
    """The scenes along which a number is differenced. Numbers that follow a parameter go along their tangent, which is exact, so
    that an expression is never differenced. size: what a step is measured by."""

    def __init__(self, scene: Scene, name: str, value: float, following: Following):
        self.scene, self.name = scene, name
        known = {p.path: p.value for p in list_parameters(scene)}
        by = following.slopes(parameter(name)) if parameter(name) else {name: 1.0}
        self.moves = {path: (known[path], slope) for path, slope in by.items()}
        reach = [_reach(path, v, s, _size(value)) for path, (v, s) in self.moves.items() if s]
        self.size = min(_size(value), *reach) if parameter(name) and reach else _size(value)

    def at(self, step: float) -> Scene:
        """The scene when the number has moved by a step."""
        return apply(self.scene, {path: v + step * slope for path, (v, slope) in self.moves.items()})


def _reach(path: str, value: float, slope: float, size: float) -> float:
    """How far a parameter of this size may go, in units of a step, before a number that follows it with this slope has gone as far
    as it should: its own size, or, where it has no bounds and may be small by chance, a tenth of what moves it."""
    free = bound_of(parse_path(path) or ()) == ANY
    return max(abs(value), 0.1 * abs(slope) * size if free else 0.0) / abs(slope) if value else size


def _size(value: float) -> float:
    return abs(value) if value else 0.1


def _column(model: Model, line: _Line) -> tuple[np.ndarray, ...]:
    for weights in (CENTRAL, FORWARD):
        with suppress(SceneError):
            return _differences(model, line, STEP * line.size, weights)
    return _differences(model, line, STEP * line.size, BACKWARD)


def _differences(model: Model, line: _Line, h: float, weights) -> tuple[np.ndarray, ...]:
    total: list[np.ndarray] | None = None
    for k, w in weights:
        built = build(line.at(k * h))
        if built.parameters.paths != model.built.parameters.paths or built.system != model.built.system:
            raise SceneError([_structural(line)])
        found = _numbers(model, built)
        total = [w / h * f for f in found] if total is None else [t + w / h * f for t, f in zip(total, found, strict=True)]
    assert total is not None
    return tuple(total)


def _structural(line: _Line) -> Problem:
    """A number that is differenced is zero as written, and so part of the structure."""
    zero = [path for path, (v, slope) in line.moves.items() if not v and slope]
    if not parameter(line.name):
        zero = [line.name]
    if not zero:
        return Problem("parameters", f"{line.name} changes the structure of the scene", "axes and turns of bodies are structure")
    what = f"{', '.join(zero)} is zero in the scene, and so part of its structure"
    return Problem("parameters", what, f'add "{zero[0]}" to the scene\'s tunable list')


def _numbers(model: Model, built: Built) -> tuple[np.ndarray, ...]:
    """What a run of this scene, which has the same structure, starts from: (run-time numbers and inputs, assembled state, times
    of kinks)."""
    block, p = model.block, np.array(built.parameters.values, float)
    block.take(built.numbers, p)
    block.configure(Settings())
    if block.assemble() != 1:
        raise SceneError([Problem("parameters", "the loops do not close at values nearby", "start further from the dead centre")])
    return np.concatenate([p, built.numbers.inputs]), block.y[: block.ny].copy(), np.array(built.numbers.breaks, float)
