"""Symbols of one part: its own numbers, coordinates and rates, which a scene's tables bind to their places."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca

from engine.parts.known import PIECE, PIECE_SIZE, Numbers
from engine.recursion.symbols import Symbols, along_piece
from engine.recursion.vectors import SX
from engine.system.leaves import Leaf, Param
from engine.system.structure import Body, Device, Fit, Joint, Signal

PRESCRIBED = Device(drive=Signal("value", (0.0,)))
"""Stands for a freedom whose motion is given, whatever gives it."""


class PartSymbols(Symbols):
    """Symbols of a part with so many numbers. Coordinates and rates of its joint are given all, prescribed ones as well."""

    def __init__(self, numbers: int, kind=None):
        self.p = SX.sym("p", numbers)
        self.q = SX.sym("q", kind.nq if kind else 0)
        self.v = SX.sym("v", kind.nv if kind else 0)
        self.known = SX.sym("known", kind.nv if kind else 0)
        self.piece = SX.sym(PIECE, PIECE_SIZE)

    def leaf(self, leaf: Leaf) -> SX:
        return self.p[leaf.index] if isinstance(leaf, Param) else SX(leaf)

    def coordinates(self, j: Joint) -> list[SX]:
        return [self.q[i] for i in range(j.kind.nq)]

    def rates(self, j: Joint) -> list[SX]:
        return [self.v[k] for k in range(j.kind.nv)]

    def curve(self, j: Joint, angle: SX) -> tuple[SX, SX, SX]:
        return along_piece(ca.vertsplit(self.piece), angle)

    def foot(self, j: Joint, p: SX) -> SX:
        return self.piece

    def driven_accelerations(self, j: Joint) -> dict[int, SX]:
        return {k: self.known[k] for k in j.driven}


def a_joint(numbers: Numbers, kind: str, forward: bool, driven: Sequence[int], pitched: bool, freedoms: int) -> Joint:
    """A joint of the tree whose frames, points and pitch are numbers of the part (18, 3 and, if it has one, 1)."""
    inb: Any = numbers.some(9)
    out: Any = numbers.some(9)
    point = numbers.some(3)
    devices = tuple(PRESCRIBED if k in driven else Device() for k in range(freedoms))
    pitch = numbers.one() if pitched else None
    return Joint("", kind, 0, 0, point, point, inb, out, Fit(), pitch, devices, None, False, 0, forward)


def a_body(numbers: Numbers) -> Body:
    """A body whose mass, mass centre and inertia are numbers of the part (1, 3 and 6)."""
    return Body("", numbers.one(), numbers.some(3), numbers.some(6), False, (), 0, 0)

