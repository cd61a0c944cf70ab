"""Loads on the bodies of a system, and devices along the freedoms of its joints, as data."""

from __future__ import annotations

from dataclasses import dataclass

from trunnion.system.structure.parameter_table import Leaf, Leaves


@dataclass(frozen=True)
class Signal:
    """A function of time. kind: "value" (one leaf), "ramp" (start, end, begin, duration, origin), "begun" (a ramp that begins
    before t = 0; a drive still has its origin at t = 0), "move_…" (a way from rest to rest: start, end, begin, duration;
    ``profiles``), "harmonic" (amplitude, frequency, phase, offset), "rate" (start, rate: q = start + rate t), "table" (index of
    a table; external inputs are the first tables) or "through" (values of an input, then what they are made into, ``KNOTS`` each;
    index: its table)."""

    kind: str
    leaves: Leaves = ()
    index: int = 0


@dataclass(frozen=True)
class Stop:
    """The compliant stops of one freedom. ``flags``: indices of the flags that say whether the lower and the upper stop are
    engaged (−1: there is no such stop)."""

    stiffness: Leaf
    damping: Leaf
    lower: Leaf | None
    upper: Leaf | None
    flags: tuple[int, int]


@dataclass(frozen=True)
class Motor:
    """A motor by its line of effort over rate: stall (effort at rest), no_load (rate without effort), both at a signal of 1."""

    stall: Leaf
    no_load: Leaf
    signal: Signal


@dataclass(frozen=True)
class Latch:
    """A hook that falls behind a passing part and then holds it.

    side: 1 keeps the part above ``at``, −1 below. holds: largest force. release: lifted while above 0.5. pressed, hook: indices of
    its flags among those of stops and of latches. down: tooth on which it begins down, 0 for up. pitch: of its teeth, 0 for one.
    """

    at: Leaf
    side: float
    stiffness: Leaf
    damping: Leaf
    holds: Leaf
    release: Signal
    pressed: int
    hook: int
    down: int = 0
    pitch: Leaf = 0.0


@dataclass(frozen=True)
class Device:
    """What acts along one freedom of a joint: spring (stiffness, rest), damping, stop, effort, motor, drive, and the inertia that
    it turns beside the bodies; None for what is not there."""

    spring: tuple[Leaf, Leaf] | None = None
    damping: Leaf | None = None
    stop: Stop | None = None
    effort: Signal | None = None
    drive: Signal | None = None
    inertia: Leaf | None = None
    motor: Motor | None = None
    latch: Latch | None = None


@dataclass(frozen=True)
class Load:
    """An applied load: a force or torque on a body, or a spring-damper or bushing between two.

    vector: of a force or torque, with None for structural zeros. numbers: of a spring-damper, stiffness, damping and length; of a
    bushing, three each of stiffness, damping, turning stiffness and turning damping, along the axes of ``frames``.
    """

    name: str
    kind: str
    bodies: tuple[int, ...]
    points: tuple[Leaves, ...]
    body_frame: bool = False
    vector: tuple[Signal | None, ...] = ()
    numbers: Leaves = ()
    frames: tuple[tuple[float, ...], ...] = ()

    @property
    def joins(self) -> bool:
        """Whether it is between two bodies."""
        return len(self.bodies) == 2

    @property
    def leaves(self) -> Leaves:
        """Numbers, points (3 each) and frames (9 each, row-major) of a load between two bodies, one after another."""
        return (*self.numbers, *(x for values in (*self.points, *self.frames) for x in values))
