"""Friction laws: interface between contact geometry and friction.

A law gives the signed friction ratio k at a sliding velocity v: the friction force on the pin is k per unit normal force (paper
(121), with ω_r, ṡ of the outboard part relative to the pin's). There are two forms: ``slope``, k = slope · v, and ``level``, k =
level(|v|) · v/|v| + drag · v; ``choose`` takes the active one. A law with a kink names the speed of the kink; the runtime ends
steps there, and within a step the branch is fixed. A set-valued law (``sets``) has no value at rest: a constraint holds the pair
while the required ratio stays within ``static``."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from enum import Enum
from typing import Any, ClassVar

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.basics.number_declarations import Number, checked_numbers
from trunnion.runtime.abi import PairState

TINY = 1e-300
HALF = 0.5
"""Halfway between two states. Comparison with it makes a step 3 percent faster than a test for equality."""
HAIR = 1e-120
"""Part of the frozen direction that is added to a velocity of several components. It has an effect only where the runtime freezes
a direction of huge length (first step of slip from rest, ``slip_onset.c``), which then is the direction of sliding."""
AT_REST = 1e-138
"""As HAIR, for the side of a velocity. For a starting pair, less than 1e-12 m/s the other way is round-off of dependent rates; for
a pair on a line (``sliding_directions.c``, with longer directions) any velocity is."""


class Rest(Enum):
    """Behaviour of a law at zero sliding velocity, which decides what the runtime does."""

    SET_VALUED = "set-valued"
    """Any ratio up to the static coefficient. The runtime holds the pair by a constraint and ends steps where sliding begins."""
    KINK = "kink"
    """A function with two branches that meet at a sliding speed (``Law.kink``). The runtime ends steps there."""
    BRISTLES = "bristles"
    """A function of a state along each velocity component (``Law.drift``, ``Law.carried``)."""
    SMOOTH = "smooth"
    """A smooth function of the velocity, without events."""


_NAME = re.compile(r"[a-z][a-z0-9_]*", re.ASCII)
_BRANCHES = {"level": "|k| while it slides", "slope": "k per sliding velocity"}


class Law:
    """A law at one friction pair.

    value: its scene numbers as expressions, by name. mode: (flag, d1, d2, d3, tilt) of the pair. The flag selects the branch. d1,
    d2, d3 are the rates at the start of the step (one rate: its sign), which fix the direction of sliding. tilt: of a ball, where
    it does not follow from the state (``elements.contact.ball_in_socket``). state: the law's states.

    The class variables declare a law. Scenes, checks, units, FMUs, time stepping, ``--hold`` and documents follow from them. An
    inconsistent declaration cannot be imported."""

    name: ClassVar[str] = ""
    """Its name in a scene."""
    numbers: ClassVar[tuple[Number, ...]] = ()
    """Its numbers in a scene, in the order of the documents."""
    rest: ClassVar[Rest]
    """What it is at rest."""
    scale: ClassVar[str] = "mu"
    """Number to which all its friction is proportional."""
    steps: ClassVar[bool] = True
    """Whether time stepping (method moreau) may use the law. It handles set-valued friction and friction smooth in the velocity."""
    exact: ClassVar[str] = ""
    """The set-valued law that this one smooths, against which errors are measured; "": none."""
    dry: ClassVar[str] = ""
    """The set-valued law that answers static questions with the same coefficients; "": the law itself, which may hold nothing at
    rest."""
    state_scale: ClassVar[str] = ""
    """With bristles: number by which the state is divided to give a deflection."""
    formula: ClassVar[str] = ""
    """k while sliding, in the symbols of ``notation.md``."""
    at_rest: ClassVar[str] = ""
    """k at rest, in the same symbols."""

    sets: ClassVar[bool] = False
    kinks: ClassVar[bool] = False
    bristles: ClassVar[bool] = False

    def __init_subclass__(cls, **kwargs: Any) -> None:
        """Refuse an inconsistent declaration; derive the flags that ``rest`` implies."""
        super().__init_subclass__(**kwargs)
        rest = getattr(cls, "rest", None)
        if not isinstance(rest, Rest):
            raise ValueError(f"law {cls.name or cls.__name__} does not say what it is at rest: rest = Rest.SET_VALUED, KINK, …")
        cls.sets, cls.kinks, cls.bristles = (rest is r for r in (Rest.SET_VALUED, Rest.KINK, Rest.BRISTLES))
        if wrong := cls._mistakes():
            place = f"law {cls.name or cls.__name__} (class {cls.__qualname__} in {cls.__module__})"
            raise ValueError("\n".join(f"{place}: {phrase}" for phrase in wrong))
        checked_numbers(f"law {cls.name}", cls.numbers)

    @classmethod
    def _mistakes(cls) -> list[str]:
        """Faults of the declaration."""
        by_name = {n.name: n for n in cls.numbers if isinstance(n, Number)}
        found = []
        if not _NAME.fullmatch(cls.name):
            found.append("its name is small letters, digits and _")
        if not by_name:
            found.append("it declares no numbers")
        if cls.scale not in by_name or not by_name[cls.scale].needed:
            found.append(f"its friction is proportional to {cls.scale}, which is none of the numbers it needs")
        if not cls.formula or not cls.at_rest:
            found.append("formula and at_rest say what it is, for the documents")
        found += cls._branches()
        if cls.kinks == (cls.kink is Law.kink):
            found.append("a law has a kink speed when rest is Rest.KINK, and only then")
        if cls.bristles == (cls.drift is Law.drift or cls.carried is Law.carried or cls.state_scale not in by_name):
            found.append("a law has drift, carried and state_scale when rest is Rest.BRISTLES, and only then")
        if cls.sets and cls.exact:
            found.append("a set-valued law smooths no other")
        return found

    @classmethod
    def _branches(cls) -> list[str]:
        """Branches that ``rest`` requires and the law lacks. ``carried`` gives friction of bristles."""
        has = {"level": cls.level is not Law.level, "slope": cls.slope is not Law.slope}
        needed = {Rest.SET_VALUED: ("level",), Rest.KINK: ("level", "slope")}.get(cls.rest, ())
        missing = [name for name in needed if not has[name]]
        if missing:
            phrase = " and ".join(f"{name}(), {_BRANCHES[name]}" for name in missing)
            return [f"with rest = Rest.{cls.rest.name} it lacks a branch; define {phrase}"]
        if cls.rest is Rest.SMOOTH and not any(has.values()):
            either = " or ".join(f"{name}(), {about}" for name, about in _BRANCHES.items())
            return [f"it has no friction while it slides; define {either}"]
        return []

    def __init__(self, value: Mapping[str, Any], mode: Sequence[Any], state: Sequence[SX] = ()):
        self.value, self.flag, self.frozen, self.tilt, self.state = value, mode[0], list(mode[1:4]), mode[4], list(state)

    def slope(self, speed2: SX) -> SX | None:
        """k per sliding velocity, s/m, on the proportional branch, at the squared sliding speed, m²/s². None: no such branch."""
        return None

    def level(self, speed2: SX) -> SX | None:
        """|k| on the sliding branch without its viscous part, at the squared sliding speed, m²/s². None: no such branch."""
        return None

    @property
    def drag(self) -> SX | None:
        """Viscous part of the sliding branch, s/m: k − ``level`` per sliding velocity. None: no viscous part."""
        return None

    def drift(self, v: Sequence[SX], state: Sequence[SX]) -> list[SX]:
        """Rates of the law's states, 1/s, at a sliding velocity (m/s). Only for laws with bristles."""
        raise NotImplementedError(f"law {self.name} has no state")

    def carried(self, v: Sequence[SX], state: Sequence[SX]) -> list[SX]:
        """Signed ratios k at a sliding velocity (m/s) and state. Only for laws with bristles."""
        raise NotImplementedError(f"law {self.name} has no state")

    @property
    def static(self) -> SX:
        """Largest |k| of a pair at rest (set-valued laws)."""
        return self.value["mu_static"] if "mu_static" in self.value else self.value["mu"]

    @property
    def stuck(self) -> SX:
        """Whether the pair is at rest, as an expression of its flag."""
        return self.flag < PairState.STUCK.value + HALF

    def moving(self, v: Sequence[SX], arms: Sequence[SX | float]) -> list[SX]:
        """Sliding velocity. For several components of a set-valued law it has a direction also at the start of slip. arms: as in
        ``sign``."""
        if not self.sets or len(v) == 1:
            return list(v)
        return [x + HAIR * d * a for x, d, a in zip(v, self.frozen, arms, strict=False)]

    @property
    def kink(self) -> SX:
        """Sliding speed at which the two branches meet, m/s."""
        return ca.SX(0)

    def choose(self, sliding: SX | None, proportional: SX | None) -> SX:
        """The value on the active branch: sliding if the flag is set, else proportional; the only one if the other is None."""
        if sliding is not None and proportional is not None:
            return ca.if_else(self.flag > PairState.PROPORTIONAL.value + HALF, sliding, proportional)
        only = proportional if sliding is None else sliding
        if only is None:
            raise ValueError(f"law {self.name} has neither branch: its level() and slope() both return None; one is needed")
        return only

    def sign(self, v: Sequence[SX], arms: Sequence[SX | float]) -> SX:
        """+1 while the velocity points to the side of the frozen direction, −1 past its reversal. arms: levers that turn rates
        into velocities, m for rotations, 1 for travels."""
        if len(v) == 1:
            return ca.if_else(v[0] * self.frozen[0] < 0, -1, 1)
        dot = sum(x * d * a for x, d, a in zip(v, self.frozen, arms, strict=False))
        return ca.if_else(dot < 0, -1, 1)

    def side(self, v: Sequence[SX], arms: Sequence[SX | float]) -> SX:
        """As ``sign``, for friction. It stays +1 past the reversal for a pair on a line (``sliding_directions.c``), whose friction
        continues until the event, and for a starting pair that is at rest but for round-off (``AT_REST``)."""
        along = [d * a for d, a in zip(self.frozen, arms, strict=False)]
        return ca.if_else(sum((x + AT_REST * d) * d for x, d in zip(v, along, strict=False)) < 0, -1, 1)

    def ratios(self, v: list[SX], arms: Sequence[SX | float] = (1.0,)) -> list[SX]:
        """Signed ratios k, one per component of the sliding velocity v (m/s). On the sliding branch the sign is fixed over a step:
        k = level · sign · v/|v| + drag · v, smooth through v = 0 along a line. arms: as in ``sign``."""
        if self.bristles:
            return self.carried(v, self.state)
        speed2 = sum((x * x for x in v), ca.SX(0))
        slope, level = self.slope(speed2), self.level(speed2)
        proportional = [None if slope is None else slope * x for x in v]
        if level is None:
            sliding: list[SX | None] = [None] * len(v)
        elif len(v) == 1:
            sliding = [level * self.frozen[0]]
        else:
            moved = self.moving(v, arms)
            speed = ca.sqrt(sum(x * x for x in moved) + TINY)
            sliding = [level * self.side(v, arms) * x / speed for x in moved]
        if self.drag is not None:
            sliding = [None if k is None else k + self.drag * x for k, x in zip(sliding, v, strict=True)]
        return [self.choose(s, p) for s, p in zip(sliding, proportional, strict=True)]
