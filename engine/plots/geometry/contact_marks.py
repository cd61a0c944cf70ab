"""Contacts of joints, with the place of each contact on its pin and the patch that shows the contact."""

from __future__ import annotations

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.contact.contact_element import Place
from trunnion.simulation.results.result import Result


@dataclass(frozen=True)
class Patch:
    """The drawn surface around a contact point.

    area: projected area that carries the contact force, m². shape: shape of the pin ("sphere", "cylinder", "box"). inward:
    direction to the pin's middle along the axis (±1, or 0 if the pin has no ends). wide: length of the patch along the pin, m.
    tall: half width of the patch on a flat pin, m. """

    area: float
    shape: str
    inward: int
    wide: float
    tall: float

    @classmethod
    def at(cls, p: Place, shape: str) -> Patch:
        """The patch at a place. On a pin without ends, the length of the patch is the pin's diameter. On other pins, the length is
        the pin's radius, but at most half of the distance to the pin's middle."""
        if p.along == 0:
            return cls(p.area, shape, 0, 2 * abs(p.arm), abs(p.arm))
        wide = min(abs(p.arm), 0.5 * abs(p.along))
        return cls(p.area, shape, -int(np.sign(p.along)), wide, min(0.5 * wide, 0.5 * p.area / abs(p.along)))


@dataclass(frozen=True)
class ContactMark:
    """A place where pin and bearing touch: ``base`` on part ``part``, plus ``arm`` times the outward normal.

    columns: prefix of the contact's columns. state: column of its friction state. axis: axis of the pin in the part's axes.
    follows: None unless the contacts of overlapping parts move along ``axis``. In this case: column of the travel, length of the
    inboard part, length of the outboard part, end of the overlap (±1).
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
        """The value of ``base`` in every row (rows × 3)."""
        if self.follows is None or self.follows[0] not in result:
            return np.tile(self.base, (len(result), 1))
        column, inner, outer, end = self.follows
        away = result[column]
        low, high = np.maximum(-inner / 2, away - outer / 2), np.minimum(inner / 2, away + outer / 2)
        return self.base + ((low + high) / 2 + end * (high - low) / 2)[:, None] * self.axis
