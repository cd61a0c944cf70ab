"""Checks of force fields: the formulas of the position, their dimension, and names that have two meanings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from trunnion.scene.data_classes.force_field import COMPONENTS, Field, PlaceFormula
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.expressions.formula_parser import parse_formula
from trunnion.scene.expressions.formula_values_and_dimensions import dimension
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.signals.position_formulas import PLACE, separate
from trunnion.scene.units.numbers_with_units import Computed, Quantity, agree
from trunnion.scene.units.unit_parser import NONE, Dimension, UnitError, parse_unit

LENGTH = parse_unit("m").dimension


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about force fields."""
    known = {n: v.dimension if isinstance(v, Quantity) else NONE for n, v in scene.parameters.items()}
    for name, f in scene.forces.items():
        if not isinstance(f, Field):
            continue
        given = [(key, getattr(f, key)) for key in COMPONENTS if getattr(f, key) is not None]
        if not given:
            yield Finding(("forces", name), "a field without components", f"give one or more of: {', '.join(COMPONENTS)}")
        for key, formula in given:
            yield from _formula(("forces", name, key), formula, known)


def _formula(path: Path, given: PlaceFormula, known: Mapping[str, Dimension]) -> Iterator[Finding]:
    try:
        wanted = len(separate(given.formula)[1])
        formula = parse_formula(given.formula)
        for name in sorted(formula.names.intersection(PLACE, known)):
            yield Finding((*path, "formula"), f"{name} is a parameter and a coordinate", "give the parameter another name")
        if formula.names - set(known) - set(PLACE):
            return  # another check reports a parameter without a value
        measured = dimension(formula.root, {**known, **dict.fromkeys(PLACE, LENGTH)})
        agree(Computed(0.0, measured, given.formula, formula.names, False), "N")
    except UnitError as e:
        yield Finding((*path, "formula"), e.what, e.hint)
        return
    if wanted != len(given.numbers):
        what = f"the formula has {wanted} constant parts, not {len(given.numbers)}"
        yield Finding((*path, "numbers"), what, "omit numbers")
