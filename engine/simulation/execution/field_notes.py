"""Notes about fields whose narrow parts a run may have passed unseen."""

from __future__ import annotations

from trunnion.scene.data_classes.force_field import COMPONENTS, Field
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.signals.position_formulas import is_polynomial, separate


def field_notes(scene: Scene) -> list[str]:
    """A note for each field that declares no width, unless its formulas are polynomials."""
    return [
        f"{name}: a step may have passed a narrow part of this field; give the field's width (forces.{name}.width)"
        for name, f in scene.forces.items()
        if isinstance(f, Field) and f.width is None and not all(_is_polynomial(f, key) for key in COMPONENTS)
    ]


def _is_polynomial(f: Field, key: str) -> bool:
    """Whether this component of the force is a polynomial, or is not given."""
    formula = getattr(f, key)
    return formula is None or is_polynomial(separate(formula.formula)[0])
