"""Time stepping by impulses: a method without coefficients (``time_stepping/moreau.c``)."""

from __future__ import annotations

from trunnion.basics.lazy_data_classes import dataclass


@dataclass(frozen=True)
class Impulses:
    """A method that applies friction and loop reactions as impulses over a step, without event location. ``fixed_order``: order
    with fixed steps. ``order``: order under error control, by extrapolation from one whole step and two half steps. ``weights``:
    factors of the whole step and of the half steps. A ValueError reports weights that contradict the orders."""

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
            raise ValueError(f"{self.name}: its weights give order = {self.fixed_order + cancels}, declared: {self.order}")


MOREAU = Impulses(
    "moreau", "Moreau's time stepping, order 1 with fixed steps, 2 under error control, for events that accumulate",
    weights=(-1.0, 2.0), fixed_order=1, order=2,
)  # fmt: skip
