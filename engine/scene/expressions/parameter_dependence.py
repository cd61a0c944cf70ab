"""Numbers of a scene that depend on its parameters: their values for changed parameters, and their exact derivatives."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from trunnion.basics.errors import Problem, raise_problems
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.expressions.formula_parser import Formula, parse_formula
from trunnion.scene.expressions.formula_values_and_dimensions import Gradient, slope, value
from trunnion.scene.expressions.parameter_evaluation import NAMED, expression_text, in_order
from trunnion.scene.findings.findings_and_paths import dotted, parse_path
from trunnion.scene.queries.numbers_by_path import number_values
from trunnion.scene.units.numbers_with_units import Computed
from trunnion.scene.units.unit_parser import UnitError


def parameter(path: str) -> str:
    """The name of the parameter that a path refers to; '' when the path refers to anything else."""
    steps = parse_path(path) or ()
    return str(steps[1]) if len(steps) == 2 and steps[0] == NAMED else ""


class DependentNumbers:
    """The expressions of a scene. ``numbers`` holds the expressions of its numbers by path; ``named`` holds the expressions of
    its parameters by name."""

    def __init__(self, scene: Scene):
        self.base = {n: float(v) for n, v in scene.parameters.items()}
        self.numbers: dict[str, Formula] = {}
        self.named: dict[str, Formula] = {}
        for path, given in number_values(scene):
            if not isinstance(given, Computed) or not given.names:
                continue
            found = parse_formula(expression_text(given.text))
            if path[0] == NAMED:
                self.named[str(path[1])] = found
            else:
                self.numbers[dotted(path)] = found
        self.order = in_order(self.named, lambda n: self.named[n].names)

    def of(self, changed: Collection[str]) -> list[str]:
        """Paths of the numbers that depend on any of these parameters, directly or through other parameters."""
        moved = set(changed)
        for n in self.order:
            if n not in changed and not moved.isdisjoint(self.named[n].names):
                moved.add(n)
        return [path for path, f in self.numbers.items() if not moved.isdisjoint(f.names)]

    def values(self, changes: Mapping[str, float], paths: Collection[str]) -> list[float]:
        """SI values of the numbers at ``paths`` when parameters take the values in ``changes``. SceneError lists the numbers
        that are undefined."""
        known = self.base | dict(changes)
        problems: list[Problem] = []
        for n in self.order:
            if n not in changes:
                known[n] = _value_or(lambda f=self.named[n]: value(f.root, known), f"{NAMED}.{n}", problems, known[n])
        out = [_value_or(lambda f=self.numbers[p]: value(f.root, known), p, problems, 0.0) for p in paths]
        raise_problems(problems)
        return out

    def slopes(self, name: str) -> dict[str, float]:
        """Derivative of each number that depends on the parameter ``name``, with respect to that parameter; the keys are paths.
        SceneError lists the numbers that have no derivative."""
        known = dict(self.base)
        along: dict[str, Gradient] = {n: {} for n in known} | {name: {name: 1.0}}
        problems: list[Problem] = []
        for n in self.order:
            if n != name:
                along[n] = _value_or(lambda f=self.named[n]: slope(f.root, known, along)[1], f"{NAMED}.{n}", problems, {})
        out = {}
        for path in self.of([name]):
            by = _value_or(lambda f=self.numbers[path]: slope(f.root, known, along)[1], path, problems, {})
            out[path] = by.get(name, 0.0)
        raise_problems(problems)
        return out


def unused_notes(scene: Scene) -> list[str]:
    """A note for every parameter on which no number depends: the user may have forgotten an expression."""
    following = DependentNumbers(scene)
    return [f"{NAMED}.{n}: no number of the scene depends on it" for n in scene.parameters if not following.of([n])]


def _value_or(work: Any, where: str, problems: list[Problem], otherwise: Any) -> Any:
    try:
        return work()
    except UnitError as e:
        problems.append(Problem(where, e.what, e.hint))
        return otherwise
