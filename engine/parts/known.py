"""By what parts are known: functions of a part as a scene's tapes call them, what decides a part's code, and what others must know
of it. No symbolic library here."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from engine.contact import REGISTRY as CONTACTS
from engine.contact.base import OVERLAP
from engine.friction.coulomb import BY_SPEED
from engine.joints import REGISTRY
from engine.system.elements import Element
from engine.system.leaves import Leaves, Param
from engine.system.structure import Fit, FrictionElement, Joint

POSE = 21
"""Numbers of a joint's pose: its inboard and outboard frame in the world (9 each, column-major) and s = p_out − p_in (3)."""
TOUCH = 7
"""Numbers of a contact for columns: normal force, angle, elevation, normal (3), state."""
AROUND = "d_"
"""Begins the names of places of vectors, beside those of numbers."""
VECTOR = "typedef double tr_vec __attribute__((vector_size(32),aligned(8)));\n"
"""Begins texts of functions of vectors (``runtime/beyond.h``)."""
PIECE, PIECE_SIZE = "piece", 5
"""The place of the piece of a cam's profile that is in force: where it starts, and its coefficients; or of a curve's foot."""
KEPT = "kept"
"""The place of what tangents keep of a point."""
BARE: dict[str, tuple[str, ...] | None] = {"": None, "moving": ("phi", "rate", "xi", "gin", "gout"), "closed": ("phi", "rate")}
"""What may be asked of a cut joint: all, or where nothing acts along its freedoms what stepping or closing needs."""


@dataclass(frozen=True)
class Part:
    """Some functions, and for each the names of its places in order. sizes: how many numbers of each kind it has (``body``); text:
    their C text, of a part that is written anew; key: by which it is kept, library: where, made: the module, the function and the
    arguments that it is written from (``store``); told: expressions of a part of one function that is written anew."""

    places: Mapping[str, tuple[str, ...]]
    sizes: Mapping[str, int] = field(default_factory=dict)
    text: str = ""
    key: str = ""
    library: str = ""
    made: tuple[str, str, tuple] = ("", "", ())
    told: Any = field(default=None, compare=False, repr=False)

    @property
    def first(self) -> str:
        """The first of its functions, by which it is told from others."""
        return next(iter(self.places))


@dataclass(frozen=True)
class Carried:
    """Which part: joint type, which way it is walked, freedoms whose motion is prescribed; rubbed: friction is found along the
    recursion; looped: with multipliers of loops; rotors: its freedoms turn inertias beside the bodies."""

    kind: str
    forward: bool
    driven: tuple[int, ...]
    rubbed: bool = False
    looped: bool = False
    rotors: bool = False

    @property
    def name(self) -> str:
        """Of its functions in C."""
        how = f"{''.join(map(str, self.driven))}{'_rubbed' * self.rubbed}{'_looped' * self.looped}{'_rotors' * self.rotors}"
        return f"p_{self.kind}_{'out' if self.forward else 'in'}{how}"

    @property
    def free(self) -> int:
        """How many freedoms are not prescribed."""
        return REGISTRY[self.kind].nv - len(self.driven)


@dataclass(frozen=True)
class Rubbing:
    """Which part: a joint with friction, without names, numbers and places."""

    joint: Joint
    needs: tuple[str, ...]

    @property
    def name(self) -> str:
        """Of its functions in C."""
        f = self.joint.friction
        assert f is not None
        words = [self.joint.kind_name, f.law, *(["adams"] if f.adams else []), self.joint.fit.label]
        curve = {name for pair in BY_SPEED[1:] for name in pair}  # one stands for all
        return "f_" + re.sub(r"\W", "_", "_".join([*words, *(name for name, _ in f.numbers if name not in curve)]))


def rubbing(e: Element) -> Rubbing:
    """The part that an element is one of."""
    f = e.friction
    first, flag = min(e.eta), f.sliders[0].flag
    sliders = tuple(replace(s, flag=s.flag - flag, eta=tuple(i - first for i in s.eta)) for s in f.sliders)
    numbers = Numbers()
    bound = tuple(i - first for i in f.bound)
    own = FrictionElement(f.contact, f.law, f.adams, tuple((name, numbers.one()) for name, _ in f.numbers), sliders, bound)
    ends = OVERLAP if e.joint.fit.ends == OVERLAP else "pin"  # where ends of one part are is told by what is handed over
    fit = Fit(e.joint.fit.pin_out and e.contact.count > 0, ends)
    joint = replace(e.joint, name="", fit=fit, inb=0, out=0, inb_point=(), out_point=(), inb_frame=(), out_frame=(), pitch=None,
                    devices=(), friction=own, cut=False, child=0, forward=True, q0=0, v0=0, rows=0, stiffness=None,
                    wheels=None)  # fmt: skip
    return Rubbing(joint, e.needs)


class Numbers:
    """Hands out the numbers of a part, one after the other."""

    def __init__(self) -> None:
        self.count = 0

    def one(self) -> Param:
        """The next number."""
        self.count += 1
        return Param(self.count - 1)

    def some(self, n: int) -> Leaves:
        """The next n numbers."""
        return tuple(self.one() for _ in range(n))


def sized(contact: str) -> tuple[str, ...]:
    """Labels of the sizes of a contact element by which its contacts bear, whether a joint gives them or not."""
    return tuple(label for s in CONTACTS[contact].sizes if s.bears for label in s.labels)
