"""Bytecode programs: calls of ops, with the slots that these calls read and write.

A call is a sequence of integers. The first three integers are the op's number, the number of operands and the number of further
integers. Then come the space and the offset of each operand, and the further integers. ``interpreter.c`` executes programs."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from dataclasses import field
from enum import IntEnum
from typing import NamedTuple

from trunnion.basics.lazy_data_classes import dataclass


class Space(IntEnum):
    """The arrays that contain slots: arguments of a kernel's functions, constants K of the scene, scratch T."""

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
    NONE = 20
    """No array: the op skips this output."""


LANES = 4
"""Number of directions along which a program of tangents differentiates at once."""


class Slot(NamedTuple):
    """Contiguous numbers of an array: the array, the first index and the count."""

    space: Space
    at: int
    size: int

    def slice(self, first: int, size: int) -> Slot:
        """A part of the slot. Raises IndexError if the part exceeds the slot."""
        if not 0 <= first <= first + size <= self.size:
            raise IndexError(f"{first}+{size} of {self}")
        return Slot(self.space, self.at + first, size)


NOWHERE = Slot(Space.NONE, 0, 0)


class Builtin(IntEnum):
    """Builtin ops, numbered as in the table of ``interpreter.c``. Each docstring has the form "operands; integers: operation"."""

    ZERO = 0
    """out; n: write n zeros."""
    COPY = 1
    """in, out; n: out = in."""
    GATHER = 2
    """parameters, constants K, out; n, then n indices: out = the selected numbers. An index i ≥ 0 selects parameter i; a negative
    index selects constant −1 − i."""
    ADD = 3
    """in, out; n: out += in."""
    COMBINE = 4
    """in, columns, z, out; n, count, stride: out = in + Σ columns[k] z[k]."""
    SELECT = 5
    """in, out; n, then n indices: out[i] = in[index i]."""
    SCALE = 6
    """in, factor (1), out; n: out = factor · in."""
    ADD_DOT = 7
    """a, b, out (1); n, sign: out += sign · aᵀb."""

    ADD_ROW_DOTS = 8
    """rows, in, out; n, count, stride of the rows, stride of out: out[k] += rows[k]·in."""
    ADD_COLUMNS = 9
    """columns, numbers, out; n, count: out += Σ columns[k] numbers[k], n numbers per column."""
    ADD_STRIDED_COLUMNS = 10
    """columns, numbers, out; n, count, stride of the columns: out += Σ columns[k] numbers[k]."""
    ADD_TRANSPOSED_PRODUCT = 11
    """columns A, column b, out; n, count of A, stride of A: out += Aᵀb."""
    MIRRORED_PRODUCT = 12
    """columns A, columns B, out, transposed out; n, count of A, count of B, strides of A, B, outs, whether to overwrite out (else
    add), whether out is a diagonal block: out = AᵀB, and its transpose. In a diagonal block, only the upper triangle is computed
    and then mirrored."""
    WRENCH_COLUMNS = 13
    """columns g, columns h (6 each), out; size of a column of out, offsets of g and h in this column, count, indices of the columns
    of g and h: copy g and h to out. The rest of out is zero."""
    TRANSPOSED_PRODUCT = 14
    """columns A, columns B, out; n, count of A, count of B, strides of A, B, out, whether to overwrite out (else add): out =
    AᵀB."""
    CUT_JOINT_FRICTION = 15
    """D, columns Pw, columns P, p0, four outputs; number of freedoms, of reaction components, of columns P. The outputs are M =
    (E + D Pw)⁻¹, −M D P, −M D p0, and the determinant of E + D Pw. Here η = e + D f is the linearised law, and f = p0 + P λ − Pw η
    are the reactions."""
    FACTOR_LOOPS = 16
    """S, outputs L, U, and pivots with the diagonal of S; n rows, order of elimination, start of each pivot's nonzeros, rows of
    these nonzeros (``system.structure.loop_matrix_fill``); indices in S of the diagonal, of the entries below the pivots, of those
    right of them (−1: zero); the entries by row (``Fill.by_row``): S = L U."""
    SOLVE_LOOPS = 17
    """L, U, g, out; the first integers of FACTOR_LOOPS: out = −S⁻¹ g."""
    CURVE_PIECE = 18
    """x (1), starts of all pieces and their coefficients (4 each), out (5); number of pieces: out = start and coefficients of the
    piece that contains x."""
    CURVE_FOOT = 19
    """p (2), curve, out (11); number of pieces: out = the foot of p on the curve. The numbers of a curve are its period (0 if it is
    open), then for each piece: start, end, arc length to the start, coefficients (4, 4)."""
    SHARED = 20
    """The arrays C, X, Y, W, MAPS and T; start, length: execute a range of the program ``shared`` with these arrays."""


BUILTINS = len(Builtin)
JOINED = (int(Builtin.ZERO), int(Builtin.COPY))
"""Ops whose calls for adjacent slots are joined to one call."""


@dataclass
class Program:
    """The calls of one function of a scene. scratch: number of doubles in T. in_ranges: whether other programs execute ranges of
    the code; such code must not move."""

    code: array[int] = field(default_factory=lambda: array("i"))
    scratch: int = 0
    in_ranges: bool = False

    def call(self, function: int, operands: Sequence[Slot], numbers: Sequence[int] = ()) -> None:
        """Append a call of an op."""
        call = [function, len(operands), len(numbers)]
        for slot in operands:
            call += slot.space, slot.at
        call += numbers
        self.code.extend(call)

    def scratch_slot(self, size: int) -> Slot:
        """Allocate a slot in T. The slot's values are valid during one execution of the program."""
        self.scratch += size
        return Slot(Space.T, self.scratch - size, size)

    def zero(self, out: Slot) -> None:
        """Append a call that writes zeros, unless the slot is empty."""
        if out.size:
            self.call(Builtin.ZERO, [out], [out.size])

    def copy(self, source: Slot, out: Slot) -> None:
        """Append a call that copies a slot, unless the slot is empty."""
        if out.size:
            self.call(Builtin.COPY, [source, out], [out.size])

    def merged(self) -> list[int]:
        """The calls that the interpreter executes. Two kinds of successive calls become one call: calls that zero or copy adjacent
        slots, and products with equidistant rows or columns."""
        out: list[int] = []
        last: list[int] = []
        code, first = self.code.tolist(), 0
        if self.in_ranges:
            return code
        while first < len(code):
            call = code[first : first + 3 + 2 * code[first + 1] + code[first + 2]]
            first += len(call)
            both = _joined(last, call) if call[0] in JOINED else _in_rows(last, call)
            if both:
                del out[-len(last) :]
            last = both or call
            out += last
        return out


def _joined(a: list[int], b: list[int]) -> list[int]:
    """One call that does the work of two successive calls. The op of the second call must be in ``JOINED``. The result is empty if
    the calls cannot be joined. Copies within an array are not joined, because the second copy may read numbers that the first one
    wrote."""
    if not a or a[0] != b[0] or a[3:-1:2] != b[3:-1:2]:
        return []
    if a[0] == Builtin.COPY and a[3] == a[5]:
        return []
    for low, high in ((a, b), (b, a)):
        if all(at + low[-1] == other for at, other in zip(low[4:-1:2], high[4:-1:2], strict=True)):
            return [*low[:-1], low[-1] + high[-1]]
    return []


def _in_rows(a: list[int], b: list[int]) -> list[int]:
    """One call that does the work of two successive calls. The second call is an ``ADD_DOT`` or ``ADD_COLUMNS`` of one column. The
    result is empty if the rows or columns of the two calls are not equidistant. The joined call adds in the same order."""
    dot = b[0] == Builtin.ADD_DOT
    several = int(Builtin.ADD_ROW_DOTS if dot else Builtin.ADD_STRIDED_COLUMNS)
    if not a or a[0] not in (b[0], several) or b[0] not in (Builtin.ADD_DOT, Builtin.ADD_COLUMNS) or b[-1] != 1:
        return []
    moved = [y - x for x, y in zip(a[4:9:2], b[4:9:2], strict=True)]
    count, stride, out = (a[10], a[11], a[-1]) if a[0] == several else (1, moved[0], moved[2])
    if a[3:9:2] != b[3:9:2] or a[9] != b[9] or (a[0] == b[0] and a[-1] != 1) or min(stride, out if dot else 1) <= 0:
        return []
    if moved != [count * stride, 0, count * out] if dot else moved != [count * stride, count, 0]:
        return []
    numbers = [b[9], count + 1, stride, *([out] if dot else [])]
    return [several, 3, len(numbers), *a[3:9], *numbers]
