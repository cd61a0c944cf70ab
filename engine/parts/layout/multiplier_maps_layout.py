"""Layout of the maps of a bytecode kernel."""

from __future__ import annotations

from functools import cached_property
from itertools import accumulate

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.parts.bytecode.program import Slot, Space
from trunnion.parts.layout.loop_matrix import LoopMatrix


@dataclass
class Maps:
    """Sizes of the maps, and the start of each kind of map (``kernel.units.stepping_unit``). active: number of rows of cut joints
    with a multiplier. ne: number of friction multipliers. nn: number of reaction components. held: whether the maps contain Q.
    matrix: layout of S; None: dense."""

    active: int
    ne: int
    nn: int
    nrates: int
    held: bool
    nkappa: int
    matrix: LoopMatrix | None = None

    @property
    def columns(self) -> int:
        """Number of multipliers. The friction multipliers are last."""
        return self.active + self.ne

    def at(self, name: str) -> int:
        """Index at which S, Se, g0, N, rates, Q or kappa starts; "end": total size. The first column of N, Q and kappa is the part
        without multipliers."""
        return self._places[name]

    @cached_property
    def _places(self) -> dict[str, int]:
        every = 1 + self.columns
        S = self.matrix.size if self.matrix else self.active**2
        sizes = {"S": S, "Se": self.active * self.ne, "g0": self.active, "N": self.nn * every, "rates": self.nrates,
                 "Q": self.ne * every if self.held else 0, "kappa": self.nkappa * every, "end": 0}  # fmt: skip
        return dict(zip(sizes, accumulate(sizes.values(), initial=0), strict=False))

    def entry(self, row: int, column: int) -> int:
        """Index of an entry of S in the maps; −1: a structural zero."""
        return self.matrix.at(row, column) if self.matrix else row + self.active * column

    def N(self, column: int) -> Slot:
        """Slot of the reaction components that a unit of multiplier ``column`` causes. Column −1 is the part without
        multipliers."""
        return Slot(Space.MAPS, self.at("N") + self.nn * (1 + column), self.nn)

    def Q(self, column: int) -> Slot:
        """Slot of the accelerations of the freedoms of frictional joints. column: see ``N``."""
        return Slot(Space.MAPS, self.at("Q") + self.ne * (1 + column), self.ne if self.held else 0)

    def kappa(self, column: int) -> Slot:
        """Slot of the scaled reactions. column: see ``N``."""
        return Slot(Space.MAPS, self.at("kappa") + self.nkappa * (1 + column), self.nkappa)
