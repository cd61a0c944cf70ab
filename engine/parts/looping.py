"""What tapes of many loops that rub keep of each loop (``coupled``)."""

from __future__ import annotations

from dataclasses import dataclass

from engine.parts.blocks import Closed
from engine.parts.tape import Block, Builtin, Tape
from engine.system.elements import Element
from engine.system.structure import GROUND


@dataclass
class Rubs:
    """Of a cut joint that rubs, with its nv freedoms, the components its law needs of its reaction, and its n multipliers: f = p0 +
    ``by_rows`` λ − ``by_friction`` η; −η = ``inverse`` (−e) + ``less`` + ``turned`` λ, once its law's derivative is known."""

    element: Element
    by_rows: Block
    by_friction: Block
    p0: Block
    inverse: Block
    turned: Block
    less: Block
    eta: Block


@dataclass
class Loop:
    """A loop along its path. rows: places of its n multipliers in λ; own: their numbers among the joint's rows; at: where the free
    rates of each body begin among those of the path (``size``), free: where among all, and how many; y: accelerations along the
    freedoms that the columns cause; along: what its rows ask of them (size × n each); pressed, sensed: columns and rows on the
    bodies, on the ground last (6 each × n)."""

    closed: Closed
    rows: list[int]
    own: list[int]
    at: dict[int, int]
    free: dict[int, tuple[int, int]]
    y: Block
    along: Block
    pressed: Block
    sensed: Block
    rubs: Rubs | None = None

    def __post_init__(self) -> None:
        self.size = sum(n for _, n in self.free.values())
        self.places = {i: 6 * k for k, i in enumerate(self.at)} | {GROUND: self.each - 6}

    @property
    def each(self) -> int:
        """Numbers of a column on the bodies."""
        return 6 * (len(self.at) + 1)

    def on(self, of: Block, i: int, k: int) -> Block:
        """Column or row k on body i."""
        return of.part(self.each * k + self.places[i], 6)

    def of(self, lam: Block) -> Block:
        """Its own of numbers of all multipliers."""
        return lam.part(self.rows[0], len(self.rows))

    def runs(self, other: Loop | None = None) -> list[tuple[int, int, int]]:
        """Bodies of the path (that it shares with another) that follow each other: the first, how many, and their free rates."""
        out: list[tuple[int, int, int]] = []
        for i in self.at:
            if other is not None and i not in other.at:
                continue
            first, count, n = out[-1] if out else (i, 0, 0)
            if first + count == i:
                out[-1:] = [(first, count + 1, n + self.free[i][1])]
            else:
                out.append((i, 1, self.free[i][1]))
        return out

    def meet(self, tape: Tape, other: Loop, S: Block, stride: int) -> None:
        """The blocks of S of this loop and another one (or itself), if their paths share a body that something moves."""
        shared = [run for run in self.runs(other) if run[2]]
        for one, two in ((self, other), (other, self)) if other is not self else ((self, self),):
            out = S.part(one.rows[0] + stride * two.rows[0], 1)
            for number, (first, _, n) in enumerate(shared):
                rows, columns = one.along.part(one.at[first], n), two.y.part(two.at[first], n)
                how = [n, len(one.rows), len(two.rows), one.size, two.size, stride, int(number == 0)]
                tape.call(Builtin.MEET, [rows, columns, out], how)

    def respond(self, tape: Tape, lam: Block, y: Block) -> None:
        """Add what these multipliers (of all loops) do to accelerations along its path to those of all freedoms."""
        for first, _, n in self.runs():
            if n:
                own = self.y.part(self.at[first], self.y.size - self.at[first])
                tape.call(Builtin.SPREAD, [own, self.of(lam), y.part(self.free[first][0], n)], [n, len(self.rows), self.size])
