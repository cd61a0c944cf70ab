"""Where joints touch, as drawn: the place of a contact on its pin, and the patch that shows it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from engine.contact.base import Place
from engine.simulation.result import Result


@dataclass(frozen=True)
class Patch:
    """What is drawn around a contact point. area: on which the contact bears (projected), m²; shape: of the pin ("sphere",
    "cylinder", "box"); inward: along the axis to the pin's middle (±1, 0: it has none); wide: along the pin, m; tall: half across
    a flat one, m."""

    area: float
    shape: str
    inward: int
    wide: float
    tall: float

    @classmethod
    def at(cls, p: Place, shape: str) -> Patch:
        """The patch of a place: as wide as the pin is thick, at most half of the way to the pin's middle."""
        if p.along == 0:
            return cls(p.area, shape, 0, 2 * abs(p.arm), abs(p.arm))
        wide = min(abs(p.arm), 0.5 * abs(p.along))
        return cls(p.area, shape, -int(np.sign(p.along)), wide, min(0.5 * wide, 0.5 * p.area / abs(p.along)))


@dataclass(frozen=True)
class ContactMark:
    """A place where pin and bearing touch: ``base`` (on part ``part``) + ``arm`` times the outward normal.

    columns: prefix of its columns; state: column of its friction state; axis: the pin's, in that part's axes; follows: of parts
    that overlap, where it is along ``axis`` from ``base`` (column of the travel, lengths of the inboard and the outboard part,
    which end: ±1).
    """

    columns: str
    state: str
    part: int
    base: np.ndarray
    arm: float
    axis: np.ndarray
    patch: Patch
    follows: tuple[str, float, float, float] | None = None

    def bases(self, result: Result) -> np.ndarray:
        """``base`` in every row (rows × 3)."""
        if self.follows is None or self.follows[0] not in result:
            return np.tile(self.base, (len(result), 1))
        column, inner, outer, end = self.follows
        away = result[column]
        low, high = np.maximum(-inner / 2, away - outer / 2), np.minimum(inner / 2, away + outer / 2)
        return self.base + ((low + high) / 2 + end * (high - low) / 2)[:, None] * self.axis
