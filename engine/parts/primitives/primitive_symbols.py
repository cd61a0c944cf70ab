"""Symbols of one primitive: its numbers, coordinates and rates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca

from trunnion.parts.primitives.primitive_keys import PIECE, PIECE_SIZE, ParameterCounter
from trunnion.recursion.symbolic_inputs import Symbols, along_piece
from trunnion.recursion.vector_algebra import SX
from trunnion.system.structure.bodies_and_joints import Body, Device, Fit, Joint, Signal
from trunnion.system.structure.parameter_table import Leaf, Param

PRESCRIBED = Device(drive=Signal("value", (0.0,)))
"""Device of a freedom with prescribed motion. Any drive would do."""


class PrimitiveSymbols(Symbols):
    """Symbols of a primitive with ``numbers`` parameters. Coordinates and rates include those of prescribed freedoms."""

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


def a_joint(numbers: ParameterCounter, kind: str, forward: bool, driven: Sequence[int], pitched: bool, freedoms: int) -> Joint:
    """A tree joint whose frames (18), point (3) and, if any, pitch (1) are numbers of the primitive."""
    inb: Any = numbers.take(9)
    out: Any = numbers.take(9)
    point = numbers.take(3)
    devices = tuple(PRESCRIBED if k in driven else Device() for k in range(freedoms))
    pitch = numbers.take_one() if pitched else None
    return Joint("", kind, 0, 0, point, point, inb, out, Fit(), pitch, devices, None, False, 0, forward)


def a_body(numbers: ParameterCounter) -> Body:
    """A body whose mass (1), mass centre (3) and inertia (6) are numbers of the primitive."""
    return Body("", numbers.take_one(), numbers.take(3), numbers.take(6), False, (), 0, 0)
