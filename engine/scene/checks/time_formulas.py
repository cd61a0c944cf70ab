"""Checks of formulas of the time: a formula must have the dimension of its load or drive."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.expressions.formula_parser import TIME, Call, Node, Number, nodes, parse_formula
from trunnion.scene.expressions.formula_values_and_dimensions import dimension
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.queries.loads_and_signals import signals
from trunnion.scene.queries.numbers_by_path import unit_of
from trunnion.scene.signals.expression import Expression
from trunnion.scene.signals.registry import all_given
from trunnion.scene.signals.time_formulas import PERIODIC
from trunnion.scene.units.numbers_with_units import Computed, Quantity, agree
from trunnion.scene.units.unit_parser import NONE, Dimension, UnitError, parse_unit

SECOND = parse_unit("s").dimension


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about the dimensions of formulas of the time."""
    known = {n: v.dimension if isinstance(v, Quantity) else NONE for n, v in scene.parameters.items()}
    for path, s in signals(scene):
        for _, data in all_given(s):
            if isinstance(data, Expression):
                yield from _formula(scene, (*path, "expression", "formula"), data.formula, known)


def _formula(scene: Scene, path: Path, text: str, known: Mapping[str, Dimension]) -> Iterator[Finding]:
    try:
        formula = parse_formula(text, timed=True)
        if formula.names - set(known) - {TIME}:
            return  # another check reports a parameter without a value
        periodic = (n for n in nodes(formula.root) if isinstance(n, Call) and n.function in PERIODIC)
        if any(_counts_cycles(n.arguments[0], known) and Number(math.pi) not in nodes(n.arguments[0]) for n in periodic):
            yield Finding(path, "Hz counts cycles, but sin and cos need an angle", "such as sin(2*pi*3 Hz*t)")
        measured = dimension(_uncounted(formula.root), {n: _without_cycles(d) for n, d in {**known, TIME: SECOND}.items()})
        agree(Computed(0.0, measured, text, formula.names, False), unit_of(scene, path))
    except UnitError as e:
        yield Finding(path, e.what, e.hint)


def _counts_cycles(node: Node, known: Mapping[str, Dimension]) -> bool:
    single = (n for n in nodes(node) if not isinstance(n, Call))
    return any((n.dimension if isinstance(n, Number) else known.get(n.name, NONE))[4] for n in single)


def _without_cycles(d: Dimension) -> Dimension:
    """The dimension, with cycles counted as radians: 2*pi*3 Hz*t is an angle."""
    a, b, c, turns, cycles = d
    return a, b, c, turns + cycles, 0


def _uncounted(node: Node) -> Node:
    """The formula, with cycles counted as radians."""
    if isinstance(node, Call):
        return Call(node.function, tuple(map(_uncounted, node.arguments)))
    return Number(node.value, _without_cycles(node.dimension)) if isinstance(node, Number) else node
