"""Loads on the bodies of a system, and devices along the freedoms of its joints, as data."""

from __future__ import annotations

from typing import Any

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.system.structure.parameter_table import Leaf, Leaves


@dataclass(frozen=True)
class Signal:
    """A function of time. ``kind`` determines the meaning of ``leaves``. ``kind`` is a label of a kind of signals
    (``scene.signals``), or one of these:

    value      a constant.
    table      no leaves; ``index`` is that of the table. External inputs are the first tables.
    through    a curve of an input: ``KNOTS`` values of the input, then ``KNOTS`` results; ``index``: the input's table.
    limit      lower and upper limit of the signal ``of``.
    place      a function of a point's position (``scene.signals.position_formulas``).

    formula: the tree of an expression (``scene.signals.time_formulas``)."""

    kind: str
    leaves: Leaves = ()
    index: int = 0
    of: Signal | None = None
    formula: tuple[Any, ...] = ()


@dataclass(frozen=True)
class Stop:
    """The compliant end stops of a freedom. flags: indices of the flags of the lower and upper stop; −1: no such stop. A flag is 1
    while its stop is engaged."""

    stiffness: Leaf
    damping: Leaf
    lower: Leaf | None
    upper: Leaf | None
    flags: tuple[int, int]


@dataclass(frozen=True)
class Motor:
    """A motor with a linear effort–rate curve. stall: effort at rate 0; no_load: rate at effort 0; both at a signal of 1."""

    stall: Leaf
    no_load: Leaf
    signal: Signal


@dataclass(frozen=True)
class Latch:
    """A hook that falls behind a passing part and then holds the part.

    side      1: the latch keeps the coordinate above ``at``; −1: below ``at``.
    holds     largest force, N or N·m.
    release   signal that lifts the hook while above 0.5.
    pressed   index, among the flags of end stops, of the flag that is 1 while the hook is pressed.
    hook      index among the latches.
    down      tooth on which the hook is at the start, from 1; 0: the hook is up.
    pitch     distance of the teeth; constant 0: a single tooth.
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
class LawForce:
    """A nonlinear spring or damper: the key of its law (``scene.force_laws``), and the law's numbers."""

    law: str
    leaves: Leaves


@dataclass(frozen=True)
class Device:
    """The devices along a freedom of a joint; None: no such device. spring: (stiffness, coordinate at rest). inertia: inertia of
    the rotor that the freedom turns in addition to the bodies. added: the inertia of the ``LightFreedom``; 0 if the freedom is not
    light. nonlinear: nonlinear springs and dampers."""

    spring: tuple[Leaf, Leaf] | None = None
    damping: Leaf | None = None
    stop: Stop | None = None
    effort: Signal | None = None
    drive: Signal | None = None
    inertia: Leaf | None = None
    motor: Motor | None = None
    latch: Latch | None = None
    added: float = 0.0
    nonlinear: tuple[LawForce, ...] | None = None

    @property
    def turned(self) -> Leaf | None:
        """Inertia that the recursion adds to the freedom: that of the rotor, or that of the ``LightFreedom``."""
        return self.inertia if self.inertia is not None else self.added or None


@dataclass(frozen=True)
class Load:
    """An applied load: a force, torque, drag or field on a body, or a spring-damper or bushing between two bodies.

    vector    components of a force or torque; None for structural zeros. Of drag: density, coefficient and area.
    numbers   spring-damper: stiffness, damping, free length. Bushing: stiffness, damping, rotational stiffness and rotational
              damping, three values each, along the axes of ``frames``. Field: its width, if given.
    nonlinear nonlinear springs and dampers along the line of a spring-damper.
    """

    name: str
    kind: str
    bodies: tuple[int, ...]
    points: tuple[Leaves, ...]
    body_frame: bool = False
    vector: tuple[Signal | None, ...] = ()
    numbers: Leaves = ()
    frames: tuple[tuple[float, ...], ...] = ()
    nonlinear: tuple[LawForce, ...] = ()

    @property
    def joins(self) -> bool:
        """Whether the load acts between two bodies."""
        return len(self.bodies) == 2

    @property
    def acts_as(self) -> str:
        """The kind of load whose primitives apply this load. A field acts like a force with the field's value."""
        return "force" if self.kind == "field" else self.kind

    @property
    def dissipates(self) -> bool:
        """Whether the load on a body only takes energy."""
        return self.kind == "drag"

    @property
    def leaves(self) -> Leaves:
        """Parameters of a load between two bodies: ``numbers``, then points (3 each), then frames (9 each, row-major)."""
        return (*self.numbers, *(x for values in (*self.points, *self.frames) for x in values))
