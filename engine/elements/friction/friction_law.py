"""The base class of friction laws: the interface between contact geometry and friction.

A law gives the signed friction ratio k at a sliding velocity v. k is the friction force on the pin divided by the normal force
(paper (121)). The velocities ω_r and ṡ in (121) are those of the outboard part relative to the part with the pin. There are two
branches: the proportional branch, k = ``slope`` · v, and the sliding branch, k = ``level``(|v|) · v/|v| + ``drag`` · v. ``choose``
selects the active branch.

A law with a kink declares the speed of the kink. The runtime ends steps at this speed; within a step the branch is fixed. A
set-valued law (``sets``) has no unique k at rest: a constraint holds the pair while the required ratio is at most ``static``."""

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
"""Offset in comparisons with integer states. Steps are 3 percent faster than with tests for equality."""
HAIR = 1e-120
"""Factor of the frozen direction in ``Law.moving``, which adds the direction times this factor to a velocity of several components.
The sum differs from the velocity only for a frozen direction of huge norm (first step of slip from rest, ``slip_onset.c``). The sum
then points in the direction of sliding."""
AT_REST = 1e-138
"""Like HAIR, but for the sign of a velocity (``Law.side``). A velocity against the frozen direction then counts as round-off of
dependent rates, and does not change the sign: below 1e-12 m/s for a starting pair, always for a pair on a line
(``frozen_sliding_directions.c``, with larger norms)."""


class Rest(Enum):
    """Behaviour of a law near zero sliding velocity. This behaviour determines how the runtime treats the law."""

    SET_VALUED = "set-valued"
    """At rest, k is any ratio up to the static coefficient. The runtime holds the pair by a constraint; steps end where sliding
    begins."""
    KINK = "kink"
    """k is a function with two branches, which meet at a sliding speed (``Law.kink``). The runtime ends steps at this speed."""
    BRISTLES = "bristles"
    """k is a function of a state with one value per velocity component (``Law.drift``, ``Law.carried``)."""
    SMOOTH = "smooth"
    """k is a smooth function of the velocity, without events."""


_NAME = re.compile(r"[a-z][a-z0-9_]*", re.ASCII)
_BRANCHES = {"level": "|k| while it slides", "slope": "k per sliding velocity"}


class Law:
    """A law at one friction pair.

    value  expressions of the law's scene numbers, by name
    mode   (flag, d1, d2, d3, tilt) of the pair. The flag selects the branch. d1, d2, d3 are the rates at the start of the step
           (for a single rate, its sign); they fix the direction of sliding. tilt: the tilt of a ball, > 0 if the runtime solves for
           the tilt (``elements.contact.ball_in_socket_friction``).
    state  the law's states

    The class variables declare a law; scenes, checks, units, FMUs, time stepping, ``--hold`` and documents use them. An
    inconsistent declaration fails at the import of its module."""

    name: ClassVar[str] = ""
    """Name of the law in a scene."""
    numbers: ClassVar[tuple[Number, ...]] = ()
    """Numbers of the law in a scene, in the order in which documents list them."""
    rest: ClassVar[Rest]
    """Behaviour of the law at rest."""
    scale: ClassVar[str] = "mu"
    """Name of the number to which all friction of the law is proportional."""
    steps: ClassVar[bool] = True
    """Whether time stepping (method moreau) supports the law. The law must be set-valued or smooth in the velocity."""
    exact: ClassVar[str] = ""
    """Name of the set-valued law that this law smooths, which is the reference for errors; "" if this law smooths no law."""
    dry: ClassVar[str] = ""
    """Name of the set-valued law with the same coefficients that static analyses use instead of this law; "" if they use this law
    itself, which may have no static friction."""
    state_scale: ClassVar[str] = ""
    """Only for bristles: name of the number by which the state is divided to give a deflection."""
    formula: ClassVar[str] = ""
    """k while sliding, in the symbols of ``notation.md``."""
    at_rest: ClassVar[str] = ""
    """k at rest, in the symbols of ``notation.md``."""

    sets: ClassVar[bool] = False
    kinks: ClassVar[bool] = False
    bristles: ClassVar[bool] = False

    def __init_subclass__(cls, **kwargs: Any) -> None:
        """Refuse an inconsistent declaration, and derive the flags that follow from ``rest``."""
        super().__init_subclass__(**kwargs)
        rest = getattr(cls, "rest", None)
        if not isinstance(rest, Rest):
            raise ValueError(f"law {cls.name or cls.__name__} does not declare its behaviour at rest: rest = Rest.SET_VALUED, …")
        cls.sets, cls.kinks, cls.bristles = (rest is r for r in (Rest.SET_VALUED, Rest.KINK, Rest.BRISTLES))
        if wrong := cls._mistakes():
            place = f"law {cls.name or cls.__name__} (class {cls.__qualname__} in {cls.__module__})"
            raise ValueError("\n".join(f"{place}: {phrase}" for phrase in wrong))
        checked_numbers(f"law {cls.name}", cls.numbers)

    @classmethod
    def _mistakes(cls) -> list[str]:
        """Faults of the declaration."""
        by_name = {n.name: n for n in cls.numbers if isinstance(n, Number)}
        unscaled = cls.scale not in by_name or not by_name[cls.scale].needed
        no_bristles = cls.drift is Law.drift or cls.carried is Law.carried or cls.state_scale not in by_name
        checks = (
            (not _NAME.fullmatch(cls.name), "its name must consist of small letters, digits and _"),
            (not by_name, "it declares no numbers"),
            (unscaled, f"its friction is proportional to {cls.scale}, which is not one of its required numbers"),
            (not cls.formula or not cls.at_rest, "formula and at_rest are missing, which the documents need"),
            *((True, fault) for fault in cls._branches()),
            (cls.kinks == (cls.kink is Law.kink), "a law has a kink speed when rest is Rest.KINK, and only then"),
            (cls.bristles == no_bristles, "a law has drift, carried and state_scale when rest is Rest.BRISTLES, and only then"),
            (cls.sets and cls.exact, "a set-valued law cannot smooth another law"),
        )
        return [fault for is_wrong, fault in checks if is_wrong]

    @classmethod
    def _branches(cls) -> list[str]:
        """Faults of the declaration: missing branches that ``rest`` requires. A law with bristles needs no branch, because it has
        ``carried``."""
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
        """k per sliding velocity, s/m, on the proportional branch, at the squared sliding speed, m²/s². Returns None if the law has
        no proportional branch."""
        return None

    def level(self, speed2: SX) -> SX | None:
        """|k| on the sliding branch without its viscous part, at the squared sliding speed, m²/s². None if the law has no sliding
        branch."""
        return None

    @property
    def drag(self) -> SX | None:
        """Viscous coefficient of the sliding branch, s/m: (|k| − ``level``) divided by the sliding speed. None if the law has no
        viscous part."""
        return None

    def drift(self, v: Sequence[SX], state: Sequence[SX]) -> list[SX]:
        """Rates of the law's states, 1/s, at a sliding velocity (m/s). Only laws with bristles have this function."""
        raise NotImplementedError(f"law {self.name} has no state")

    def carried(self, v: Sequence[SX], state: Sequence[SX]) -> list[SX]:
        """Signed ratios k at a sliding velocity (m/s) and state. Only laws with bristles have this function."""
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
        """Sliding velocity. At the start of slip, v is zero. For a set-valued law with several components, the result then has the
        frozen direction. ``arms`` as in ``sign``."""
        if not self.sets or len(v) == 1:
            return list(v)
        return [x + HAIR * d * a for x, d, a in zip(v, self.frozen, arms, strict=False)]

    @property
    def kink(self) -> SX:
        """Sliding speed at which the two branches meet, m/s."""
        return ca.SX(0)

    def choose(self, sliding: SX | None, proportional: SX | None) -> SX:
        """The value on the active branch: ``sliding`` if the flag is set, otherwise ``proportional``. If one value is None, the
        result is the other value."""
        if sliding is not None and proportional is not None:
            return ca.if_else(self.flag > PairState.PROPORTIONAL.value + HALF, sliding, proportional)
        only = proportional if sliding is None else sliding
        if only is None:
            raise ValueError(f"law {self.name} has neither branch: its level() and slope() both return None; one is needed")
        return only

    def sign(self, v: Sequence[SX], arms: Sequence[SX | float]) -> SX:
        """+1 while the velocity has a positive component along the frozen direction, −1 after its reversal. ``arms`` are factors
        from rates to velocities: lever arms in m for rotations, 1 for travels."""
        if len(v) == 1:
            return ca.if_else(v[0] * self.frozen[0] < 0, -1, 1)
        dot = sum(x * d * a for x, d, a in zip(v, self.frozen, arms, strict=False))
        return ca.if_else(dot < 0, -1, 1)

    def side(self, v: Sequence[SX], arms: Sequence[SX | float]) -> SX:
        """The sign that the formulas of friction use. This is the result of ``sign``, except that the sign stays +1 after the
        reversal in two cases. The friction of a pair on a line (``frozen_sliding_directions.c``) continues until the event. A
        starting pair's velocity does not count at round-off level (``AT_REST``)."""
        along = [d * a for d, a in zip(self.frozen, arms, strict=False)]
        return ca.if_else(sum((x + AT_REST * d) * d for x, d in zip(v, along, strict=False)) < 0, -1, 1)

    def ratios(self, v: list[SX], arms: Sequence[SX | float] = (1.0,)) -> list[SX]:
        """Signed ratios k, one for each component of the sliding velocity v (m/s). On the sliding branch, the sign is fixed during
        a step: k = level · sign · v/|v| + drag · v. For motion along a line, k is therefore smooth through v = 0. ``arms`` as in
        ``sign``."""
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
