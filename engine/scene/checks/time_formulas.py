"""Checks of formulas of the time: their dimension must be that of the load or drive."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.expressions.formula_evaluation import dimension
from trunnion.scene.expressions.formula_parser import TIME, parse_formula
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.queries.loads_and_signals import signals
from trunnion.scene.queries.number_units import unit_of
from trunnion.scene.units.quantities import Computed, Quantity, agree
from trunnion.scene.units.unit_parser import NONE, Dimension, UnitError, parse_unit


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about the dimensions of formulas of the time."""
    known = {n: v.dimension if isinstance(v, Quantity) else NONE for n, v in scene.parameters.items()}
    for path, s in signals(scene):
        if s.expression is not None:
            yield from _formula(scene, (*path, "expression", "formula"), s.expression.formula, known)


def _formula(scene: Scene, path: Path, text: str, known: Mapping[str, Dimension]) -> Iterator[Finding]:
    try:
        formula = parse_formula(text, timed=True)
        if formula.names - set(known) - {TIME}:
            return  # the constant part with this name has no value, which is reported there
        measured = dimension(formula.root, {**known, TIME: parse_unit("s").dimension})
        agree(Computed(0.0, measured, text, formula.names, False), unit_of(scene, path))
    except UnitError as e:
        yield Finding(path, e.what, e.hint)
