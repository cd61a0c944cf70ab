"""A damper whose force grows with the square of the rate: F = c₂ v |v|."""

from __future__ import annotations

from collections.abc import Sequence

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.scene.force_laws.declaration import ForceLaw
from trunnion.scene.units.numbers_with_units import NotNegative


class QuadraticDampingLaw(ForceLaw):
    """Leaf of the law: the coefficient c₂."""

    key, data, text = "quadratic_damping", NotNegative, "Damper whose effort is this number times the square of the rate."
    units, count, elastic = {"quadratic_damping": "{f}*s^2/{x}^2"}, 1, False

    def numbers(self, data: float) -> Sequence[tuple[str, float]]:
        return [("", data)]

    def force(self, n: Sequence[SX], x: SX, rate: SX) -> SX:
        return n[0] * rate * ca.fabs(rate)
