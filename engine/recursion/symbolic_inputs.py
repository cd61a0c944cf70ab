"""Inputs of the symbolic model: time, state, external values, parameters and multipliers. The numbers and signals of the scene are
expressions of these inputs."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from trunnion.basics.monotone_curves import KNOTS, monotone
from trunnion.recursion.curve_foot_point import find_foot, numbers_of_piece
from trunnion.recursion.vector_algebra import SX, vector
from trunnion.scene.signals.registry import OF_LABEL
from trunnion.system.structure.bodies_and_joints import Joint, Latch, Signal, System, state_coordinates
from trunnion.system.structure.external_value_layout import INSIDE, MODE, NOW
from trunnion.system.structure.parameter_table import Leaf, Leaves, Param


class Symbols:
    """Symbols of one system.

    t      time, s.
    ts     a time inside the current step, s, which selects the active piece of a signal.
    x      external values (``system.structure.external_value_layout``); the first two are t and ts.
    q, v   state coordinates (nq) and rates (nv).
    b      bristle states.
    p      parameters.
    lam    multipliers of the rows of cut joints.
    eta    friction multipliers."""

    def __init__(self, system: System, parameters: int):
        self.system = system
        self.at = system.external
        self.x = SX.sym("x", self.at.size)
        self.t, self.ts = self.x[NOW], self.x[INSIDE]
        self.q, self.v = SX.sym("q", system.nq), SX.sym("v", system.nv)
        self.b = SX.sym("b", len(system.bristles))
        self.p = SX.sym("p", parameters)
        self.lam, self.eta = SX.sym("lam", system.rows), SX.sym("eta", system.neta)

    def leaf(self, leaf: Leaf) -> SX:
        """A number of the scene: a constant, or a parameter of the run."""
        return self.p[leaf.index] if isinstance(leaf, Param) else SX(leaf)

    def leaves(self, leaves: Leaves) -> SX:
        """Several numbers of the scene as a column."""
        return vector([self.leaf(x) for x in leaves])

    def curve(self, j: Joint, angle: SX) -> tuple[SX, SX, SX]:
        """Distance of a cam follower from the cam's axis at an angle of the profile, and its first and second derivatives by the
        angle."""
        assert j.profile is not None
        pieces = [(start, *piece) for start, piece in zip(j.profile.starts, j.profile.pieces, strict=True)]
        return along_piece(numbers_of_piece(pieces, angle), angle)

    def foot(self, j: Joint, p: SX) -> SX:
        """The foot of point p on the joint's curve (the numbers that ``coupling_joint_data.FOOT`` describes)."""
        assert j.curve is not None
        return find_foot(j.curve, p)

    def stop_flag(self, index: int) -> SX:
        """Flag of a stop: 1 while the stop is engaged."""
        return self.x[self.at.stop(index)]

    def latch_flags(self, latch: Latch) -> tuple[SX, SX]:
        """State of a latch: the number of the hook's tooth (0 if the hook is up), and a flag that is 1 while the hook is
        pressed."""
        return self.stop_flag(self.system.hook(latch.hook)), self.stop_flag(latch.pressed)

    def mode(self, slider: int) -> list[SX]:
        """Mode of a friction pair: state flag, frozen direction (3) and given tilt (``elements.friction.friction_law``)."""
        k = self.at.mode(slider)
        return [self.x[k + i] for i in range(MODE)]

    def load(self, s: Signal) -> SX:
        """Value of the signal of a load or effort at t."""
        if s.kind == "value":
            return self.leaf(s.leaves[0])
        if s.kind == "table":
            return self.x[self.at.table(s.index)]
        if s.kind == "through":
            at, value = (self.leaves(x) for x in (s.leaves[:KNOTS], s.leaves[KNOTS:]))
            return monotone(self.given(s.index), ca.vertsplit(at), ca.vertsplit(value))
        if s.of is not None:
            lower, upper = (self.leaf(x) for x in s.leaves)
            return ca.fmax(lower, ca.fmin(upper, self.load(s.of)))
        return OF_LABEL[s.kind].load(self, s)

    def given(self, index: int) -> SX:
        """Value of a table or input at t."""
        return self.x[self.at.table(index)]

    def motion(self, s: Signal) -> tuple[SX, SX, SX]:
        """Position, rate and acceleration that a drive prescribes at t."""
        if s.kind == "table":
            k = self.at.table(s.index)
            return self.x[k], self.x[k + 1], self.x[k + 2]
        return OF_LABEL[s.kind].motion(self, s)

    def coordinates(self, j: Joint) -> list[SX]:
        """All coordinates of a tree joint: states for free freedoms, signals for driven freedoms."""
        states = state_coordinates(j)
        out = [self.q[j.q0 + states.index(i)] if i in states else SX(0) for i in range(j.kind.nq)]
        for k in j.driven:
            drive = j.devices[k].drive
            assert drive is not None
            out[j.kind.coordinate_of(k)] = self.motion(drive)[0]
        return out

    def rates(self, j: Joint) -> list[SX]:
        """All rates of a tree joint: states for free freedoms, signals for driven freedoms."""
        given = [d.drive for d in j.devices]
        return [self.v[j.v0 + j.free.index(k)] if d is None else self.motion(d)[1] for k, d in enumerate(given)]

    def driven_accelerations(self, j: Joint) -> dict[int, SX]:
        """Accelerations of the driven freedoms of a joint, by freedom."""
        return {k: self.motion(d.drive)[2] for k, d in enumerate(j.devices) if d.drive is not None}


def along_piece(piece: Sequence[SX], angle: SX) -> tuple[SX, SX, SX]:
    """Value, first and second derivative of a cubic. piece: start angle, then the four coefficients of powers of (angle −
    start)."""
    x, (a, b, c, d) = angle - piece[0], piece[1:]
    return a + x * (b + x * (c + x * d)), b + x * (2 * c + 3 * x * d), 2 * c + 6 * x * d
