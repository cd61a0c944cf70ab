"""Time stepping by impulses, a method without coefficients (``time_stepping/moreau.c``)."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Impulses:
    """A method with friction and loops as impulses over a step, without event location. ``fixed_order``: order of fixed steps.
    ``order``: order under error control, where a step made whole and one made in halves are extrapolated. ``weights``: of the
    whole and the halves. ValueError if weights and orders disagree."""

    name: str
    about: str
    weights: tuple[float, float]
    fixed_order: int
    order: int

    def __post_init__(self) -> None:
        whole, halves = self.weights
        if whole + halves != 1:
            raise ValueError(f"{self.name}: weights {self.weights} do not add up to 1")
        cancels = whole + halves / 2**self.fixed_order == 0
        if self.order != self.fixed_order + cancels:
            raise ValueError(f"{self.name}: its coefficients say order = {self.fixed_order + cancels}, it says {self.order}")


MOREAU = Impulses(
    "moreau", "Moreau's time stepping, order 1 with fixed steps, 2 under error control, for events that accumulate",
    weights=(-1.0, 2.0), fixed_order=1, order=2,
)  # fmt: skip
