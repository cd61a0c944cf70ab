"""Methods without coefficients: time stepping by impulses, which the runtime carries out by itself (``runtime/moreau.c``)."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Impulses:
    """A method that treats friction and loops as impulses over a fixed step, so that events need not be located. Its order is 1."""

    name: str
    about: str
    order: int = 1


MOREAU = Impulses("moreau", "Moreau's time stepping, order 1, for events that accumulate")
