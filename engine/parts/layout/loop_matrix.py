"""Layout of S in (90), in blocks, one for each pair of coupled loops."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from trunnion.system.structure.loop_matrix_fill import Fill


class LoopMatrix:
    """Where S is stored: in blocks of rows × columns, column by column. rows: the rows of each loop. near: for each loop, the loops
    coupled to this loop. fill: pattern of the factor. symmetric: whether one block is stored for each pair of loops (with the rows
    of the loop of smaller index); otherwise two."""

    def __init__(self, rows: Sequence[Sequence[int]], near: Sequence[Collection[int]], fill: Fill, symmetric: bool):
        self.fill, self.size, self.rows = fill, 0, rows
        self._loop = {row: (loop, k) for loop, own in enumerate(rows) for k, row in enumerate(own)}
        self._block: dict[tuple[int, int], int] = {}
        for loop, others in enumerate(near):
            for other in sorted({loop, *others}):
                if other >= loop or not symmetric:
                    self._block[loop, other] = self.size
                    self.size += len(rows[loop]) * len(rows[other])

    def at(self, row: int, column: int) -> int:
        """Index of an entry of S; −1: a structural zero."""
        (loop, i), (other, k) = self._loop[row], self._loop[column]
        if (loop, other) in self._block:
            return self._block[loop, other] + i + len(self.rows[loop]) * k
        transposed = self._block.get((other, loop))
        return -1 if transposed is None else transposed + k + len(self.rows[other]) * i

    def largest(self, S: np.ndarray) -> np.ndarray:
        """The largest magnitude in each row of a symmetric S."""
        out = np.zeros(len(self._loop))
        for (loop, other), first in self._block.items():
            own, across = self.rows[loop], self.rows[other]
            block = np.abs(S[first : first + len(own) * len(across)].reshape(len(across), len(own)))
            out[own], out[across] = np.maximum(out[own], block.max(0)), np.maximum(out[across], block.max(1))
        return out
