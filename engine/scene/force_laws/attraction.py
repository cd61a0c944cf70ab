"""Attraction by a point: μ m / r². Only loads have this law (``PointGravity``); nonlinear springs have no key for it."""

from __future__ import annotations

from collections.abc import Sequence

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.scene.force_laws.declaration import ForceLaw


class AttractionLaw(ForceLaw):
    """Leaves of the law: gravitational constant times attracting mass, and the attracted mass. The energy is 0 at infinity."""

    key, data, text = "attraction", None, ""
    count, elastic, pieces = 2, True, True

    def force(self, n: Sequence[SX], x: SX, rate: SX) -> SX:
        return n[0] * n[1] / (x * x)

    def passed(self, n: Sequence[SX], x: SX, rate: SX) -> SX:
        return ca.log(x)

    def stored(self, n: Sequence[SX], x: SX) -> SX:
        return -n[0] * n[1] / x
