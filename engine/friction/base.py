"""The seam between contact geometry and friction law.

A law is asked for the signed friction ratio k of a sliding velocity v (friction force on the pin = k per unit normal force, (121)
with ω_r, ṡ of the outboard part relative to the pin's). Two forms cover the closed contact forms:
``slope``: k = slope · v, and ``level``: k = level(|v|) · v/|v| + drag · v; ``choose`` takes the one in force. A law with kinks
names the value the sliding speed crosses, so that the runtime ends its steps there; within a step the branch is frozen. A
set-valued law (``sets``) has no value at rest: there the runtime holds the pair by a constraint as long as the ratio needed stays
within ``static``.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import casadi as ca

SX = ca.SX
TINY = 1e-300
HAIR = 1e-120
"""Part of the frozen direction added to a velocity of several components: nothing, unless the runtime freezes a direction of huge
length, which then is the direction of sliding (the first step of slip from rest, ``onset.c``)."""


class Law(ABC):
    """A law at one sliding pair. numbers: its scene numbers as expressions; mode: (flag, d1, d2, d3, tilt) of the pair, the state
    flag, the rates at the start of the step (a single rate: its sign), against which the direction of sliding is frozen, and for a
    ball the tilt where it is not to follow from the state (``contact.ball``)."""

    name: ClassVar[str]
    kinks: ClassVar[bool] = False
    """Whether the branch changes at a sliding speed (then ``kink`` is that speed and the mode flag says which branch)."""

    sets: ClassVar[bool] = False
    """Whether the law is set-valued at rest."""

    bristles: ClassVar[bool] = False
    """Whether the law has a state along each velocity component (then ``drift`` and ``carried``)."""

    def __init__(self, numbers: Mapping[str, Any], mode: Sequence[Any], state: Sequence[SX] = ()):
        self.numbers, self.flag, self.frozen, self.tilt, self.state = numbers, mode[0], list(mode[1:4]), mode[4], list(state)

    @property
    @abstractmethod
    def slope(self) -> SX | None:
        """k per sliding velocity on the proportional branch, None when the law has none."""

    @abstractmethod
    def level(self, speed2: SX) -> SX | None:
        """|k| on the sliding branch at the squared sliding speed (m²/s²) without its viscous part, None when the law has none."""

    @property
    def drag(self) -> SX | None:
        """Viscous part of the sliding branch, s/m: k beyond ``level`` per sliding velocity; None when the law has none."""
        return None

    def drift(self, v: Sequence[SX], state: Sequence[SX]) -> list[SX]:
        """Rates of the states, 1/s, at a sliding velocity (m/s)."""
        raise NotImplementedError(f"law {self.name} has no state")

    def carried(self, v: Sequence[SX], state: Sequence[SX]) -> list[SX]:
        """Signed ratios k at a sliding velocity (m/s) and state."""
        raise NotImplementedError(f"law {self.name} has no state")

    @property
    def static(self) -> SX:
        """|k| up to which a pair at rest is held (set-valued laws)."""
        return self.numbers["mu_static"] if "mu_static" in self.numbers else self.numbers["mu"]

    @property
    def stuck(self) -> SX:
        """Whether the pair is held at rest."""
        return self.flag < 0.5

    def moving(self, v: Sequence[SX], arms: Sequence[SX | float]) -> list[SX]:
        """The velocity, with a direction even at the moment slip starts from rest."""
        if not self.sets or len(v) == 1:
            return list(v)
        return [x + HAIR * d * a for x, d, a in zip(v, self.frozen, arms, strict=False)]

    @property
    def kink(self) -> SX:
        """Sliding speed at which the branches meet."""
        return SX(0)

    def choose(self, sliding: SX | None, proportional: SX | None) -> SX:
        """The value of the branch in force."""
        if sliding is not None and proportional is not None:
            return ca.if_else(self.flag > 0.5, sliding, proportional)
        only = proportional if sliding is None else sliding
        if only is None:
            raise ValueError(f"law {self.name} has neither branch")
        return only

    def sign(self, v: Sequence[SX], arms: Sequence[SX | float]) -> SX:
        """+1 while the velocity still points to the side of the frozen one, −1 past its reversal. ``arms``: lever that turns
        each rate into a velocity."""
        if len(v) == 1:
            return ca.if_else(v[0] * self.frozen[0] < 0, -1, 1)
        dot = sum(x * d * a for x, d, a in zip(v, self.frozen, arms, strict=False))
        return ca.if_else(dot < 0, -1, 1)

    def ratios(self, v: list[SX], arms: Sequence[SX | float] = (1.0,)) -> list[SX]:
        """Signed ratios k of one or two velocity components (m/s). On the sliding branch the sign is frozen over a step:
        k = level · sign · v/|v| + drag · v, smooth through v = 0 along a line."""
        if self.bristles:
            return self.carried(v, self.state)
        slope, level = self.slope, self.level(sum((x * x for x in v), SX(0)))
        proportional = [None if slope is None else slope * x for x in v]
        if level is None:
            sliding: list[SX | None] = [None] * len(v)
        elif len(v) == 1:
            sliding = [level * self.frozen[0]]
        else:
            moved = self.moving(v, arms)
            speed = ca.sqrt(sum(x * x for x in moved) + TINY)
            sliding = [level * self.sign(v, arms) * x / speed for x in moved]
        if self.drag is not None:
            sliding = [None if k is None else k + self.drag * x for k, x in zip(sliding, v, strict=True)]
        return [self.choose(s, p) for s, p in zip(sliding, proportional, strict=True)]
