"""Tapes: what the functions of a scene do, as calls of parts with the places of what they read and write.

A call is a row of integers: which function, how many places and further numbers follow, then (space, offset) of each place, then
the numbers. ``machine.c`` walks along it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np


class Space(IntEnum):
    """The arrays that places lie in: those that a function of a kernel is handed, the scene's constants K, and scratch T."""

    K = 0
    P = 1
    C = 2
    X = 3
    Y = 4
    W = 5
    MAPS = 6
    DY = 7
    Z = 8
    T = 9
    N = 10
    R = 11
    U = 12
    OUT = 13
    DN = 14
    SPEED = 15
    A = 16
    EXTRA = 17
    POWER = 18
    D = 19


LANES = 4
"""Directions that are followed at once: numbers of the vectors in D, beside numbers that they change (``directions.py``)."""


@dataclass(frozen=True)
class Block:
    """Numbers that lie behind each other: where they begin, and how many they are."""

    space: Space
    at: int
    size: int

    def part(self, first: int, size: int) -> Block:
        """Some of them."""
        if not 0 <= first <= first + size <= self.size:
            raise IndexError(f"{first}+{size} of {self}")
        return Block(self.space, self.at + first, size)


class Builtin(IntEnum):
    """Functions of the machine itself, by their place in its table. Places, then numbers."""

    ZERO = 0
    """out; n: n zeros."""
    COPY = 1
    """in, out; n."""
    GATHER = 2
    """p, K, out; n, then an index each: of a parameter, or −1 − that of a constant."""
    ADD = 3
    """in, out; n: added to what is there."""
    COMBINE = 4
    """in, columns, z, out; n, count, stride: in + Σ columns[k] z[k]."""
    PICK = 5
    """in, out; n, then an index each."""
    SCALE = 6
    """in, factor (1), out; n."""
    PRODUCT = 7
    """in, in, out (1); n, sign: sign times the sum of their products, added."""


    DOTS = 8
    """rows, in, out; n, count, stride of the rows, stride of out: products of the rows with in, added."""
    ALONG = 9
    """columns, numbers, out; n, count: Σ columns[k] numbers[k], added (n in each column)."""
    SPREAD = 10
    """The same; n, count, stride of the columns."""
    GRAM = 11
    """columns A, columns b, out; n, how many A, stride of A: Aᵀb, added."""
    COUPLE = 12
    """columns A, columns B, out, transposed out; n, how many A, how many B, strides of A, of B, of both outs, whether they are new,
    whether they are one block on the diagonal (of which the upper triangle is computed): AᵀB, or added."""
    WRENCHES = 13
    """columns g, columns h (6), out; numbers of a column of out, where g goes in it, where h, how many, and which; else zeros."""
    MEET = 14
    """columns A, columns B, out; n, how many A, how many B, strides of A, of B, of out, whether it is new: AᵀB, or added."""
    GRIP = 15
    """D, columns Pw, columns P, p0, out (E + D Pw)⁻¹, that times −D P, times −D p0, determinant; freedoms, needs, how many P."""
    FACTOR = 16
    """S, out L, out U, pivots; n, its order, where the entries below each pivot begin in it, these (``system.coupling``)."""
    SOLVE = 17
    """L, U, g, out; the same: −S⁻¹ g."""
    PIECE = 18
    """x (1), starts and then four coefficients each, out (5); how many: where the piece starts that x is in, and its own."""
    FOOT = 19
    """p (2), how long around (0: open) and then of each piece start, end, way, coefficients (4, 4), out (11); how many."""


BUILTINS = len(Builtin)


@dataclass
class Tape:
    """The calls of one function of a scene."""

    code: list[int] = field(default_factory=list)
    scratch: int = 0

    def call(self, function: int, places: Sequence[Block], numbers: Sequence[int] = ()) -> None:
        """Call a function of the scene's table."""
        self.code += [function, len(places), len(numbers)]
        for b in places:
            self.code += [b.space, b.at]
        self.code += numbers

    def scratch_block(self, size: int) -> Block:
        """Numbers of its own that last as long as the call of the function."""
        self.scratch += size
        return Block(Space.T, self.scratch - size, size)

    def zero(self, out: Block) -> None:
        """Zeros."""
        if out.size:
            self.call(Builtin.ZERO, [out], [out.size])

    def copy(self, source: Block, out: Block) -> None:
        """Copy all of a block."""
        if out.size:
            self.call(Builtin.COPY, [source, out], [out.size])

    def array(self) -> np.ndarray:
        """The calls as the machine reads them."""
        return np.array(self.code, np.intc)
