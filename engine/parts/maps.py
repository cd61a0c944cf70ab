"""Where everything is in the maps block of a scene made of parts."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate

from engine.parts.tape import Block, Space


@dataclass
class Maps:
    """How many numbers of each kind the maps block of a scene holds, and where each kind begins (``kernel.main_unit``). active:
    rows of cut joints that have a multiplier."""

    active: int
    ne: int
    nn: int
    nrates: int
    held: bool
    nkappa: int

    @property
    def columns(self) -> int:
        """Multipliers, those of friction last."""
        return self.active + self.ne

    def at(self, name: str) -> int:
        """Where S, Se, g0, N, rates, Q and the end are; N and Q have a column without multipliers first."""
        return self._places[name]

    @cached_property
    def _places(self) -> dict[str, int]:
        every = 1 + self.columns
        sizes = {"S": self.active**2, "Se": self.active * self.ne, "g0": self.active, "N": self.nn * every, "rates": self.nrates,
                 "Q": self.ne * every if self.held else 0, "kappa": self.nkappa * every, "end": 0}  # fmt: skip
        return dict(zip(sizes, accumulate(sizes.values(), initial=0), strict=False))

    def N(self, column: int) -> Block:
        """Reaction components that multiplier ``column`` causes, −1: that there are without any."""
        return Block(Space.MAPS, self.at("N") + self.nn * (1 + column), self.nn)

    def Q(self, column: int) -> Block:
        """Accelerations of the freedoms of frictional joints, likewise."""
        return Block(Space.MAPS, self.at("Q") + self.ne * (1 + column), self.ne if self.held else 0)

    def kappa(self, column: int) -> Block:
        """Scaled reactions, likewise."""
        return Block(Space.MAPS, self.at("kappa") + self.nkappa * (1 + column), self.nkappa)
