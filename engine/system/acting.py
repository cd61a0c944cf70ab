"""What acts on the bodies of a system and along the freedoms of its joints, as data."""

from __future__ import annotations

from dataclasses import dataclass

from engine.system.leaves import Leaf, Leaves


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
    """A hook that falls behind what has passed it, and does not let it back: ``at``, side (1: it keeps above, −1: below),
    stiffness, damping, what it holds; release: lifted while this is above a half. pressed, hook: its flags among those of stops
    and of hooks; down: on which tooth it begins down, wherever that is (0: up); pitch: of its teeth, 0 where it has but one."""

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
    """An applied load: a force or torque on a body, whose ``vector`` has signals and None for structural zeros, or what joins two
    points: a spring-damper with its ``numbers`` (stiffness, damping, length), or a bushing with three each of stiffness, damping,
    turning stiffness and turning damping along the axes of ``frames`` on its two bodies."""

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
