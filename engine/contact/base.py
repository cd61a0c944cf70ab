"""What a contact element is: closed forms from the joint reaction to contact forces, contact points and friction.

f_c, m_c act on the part that carries the pin, in the pin's frame (NOTATION, "Reactions, friction and contacts"); the forms are
derived in METHOD, "Contact forms". An element's file holds one function for each field of ``ContactElement``, which says there
what it does.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from engine.basics.numbers import Number, checked_numbers
from engine.basics.symbolic import SX, ca
from engine.friction import Law

if TYPE_CHECKING:
    from engine.contact.resting import Pair, Rubs

TINY = 1e-300
COMPONENTS = ("f1", "f2", "f3", "m1", "m2", "m3")


FIXED, OVERLAP = "fixed", "overlap"
"""Choices of where contacts sit: at the ends of one part, or where two parts end to touch."""
SPAN = "span"
"""Beside the components of f_c, m_c: half the length over which two parts of finite length touch, m."""


@dataclass(frozen=True)
class Wrench:
    """What a joint presses on the part with the pin: the components of f_c (N) and m_c (N m) that an element needs (and
    SPAN), by name.
    ``pin`` is +1 when that is the inboard part, −1 when it is the outboard one: by it signed friction ratios change."""

    values: Mapping[str, SX]
    pin: int

    def __getitem__(self, name: str) -> SX:
        return self.values[name]


@dataclass(frozen=True)
class Contact:
    """One contact. force: its normal force, N, never negative; vector: that force times the outward unit normal on the pin (3), so
    that a contact without force has no direction; plane: the two axes in which its angle is measured (that of its cosine, that of
    its sine). Both in the pin's frame, or in the inboard joint frame where ``inboard`` says so. watched: what goes through zero as
    the contact changes sides, if not the vector (of teeth, whose force turns less than half round, its part along their way)."""

    force: SX
    vector: tuple[SX, SX, SX]
    plane: tuple[int, int]
    inboard: bool = False
    watched: tuple[SX, SX, SX] | None = None


@dataclass(frozen=True)
class Size(Number):
    """A size of a contact element. drawn: in pictures of a joint that has none, as a part of the mechanism's length; bears: whether
    what contacts carry as springs depends on it (``ContactElement.pressed``); ends: the choice of a joint's ``ends`` that it
    belongs to, FIXED or OVERLAP, where it belongs to one alone."""

    drawn: float = 0.025
    bears: bool = True
    ends: str = ""


PARTS = ("pin", "inboard", "outboard")


@dataclass(frozen=True)
class Place:
    """Where a contact sits: ``along`` (m) its part's joint axis e1, e2 or e3 (``axis`` 0, 1, 2) from its point, then ``arm``
    (m) along the outward normal. on: the part that carries the pin, or the inboard or outboard part whichever does. pair: the
    sliding pair it belongs to, from 0. area: on which it bears, m² (projected); arc: of a contact that goes around, m² of surface
    a rad."""

    on: str
    axis: int
    along: float
    arm: float
    pair: int = 0
    area: float = 0.0
    arc: float = 0.0


@dataclass(frozen=True)
class Solid:
    """A pin as drawn: "cylinder" (radius, length), "sphere" (radius) or "box" (three edges), m, along joint axis ``axis`` of the
    part it is ``on``."""

    shape: str
    sizes: tuple[float, ...]
    on: str = "pin"
    axis: int = 0


@dataclass(frozen=True)
class Hold:
    """What a pair at rest can hold: the friction force at the surface it can carry in the asked direction (N), the size of the
    asked friction as such a force (N; the friction ratio is size/capacity), and the part of it no friction can carry (N; a point
    contact holds no torque about the force)."""

    capacity: SX
    size: SX
    beyond: SX | float = 0.0


def ratio_held(load: Callable[[SX], SX], size: SX, rounds: int = 6) -> SX:
    """The ratio |k| at which a pair at rest carries friction of this size: k · load(k) = size, by so many rounds of Newton's method
    written out (the left side grows with k and is smooth up to the limit of sticking; METHOD, "Rest")."""
    k = ca.SX.sym("k")
    residual = k * load(k) - size
    step = k - residual / (ca.jacobian(residual, k) + TINY)
    out = size / (load(ca.SX(0)) + TINY)
    for _ in range(rounds):
        out = ca.substitute(step, k, out)
    return out


def while_sliding(law: Law, ratio: SX) -> SX:
    """A pair's friction ratio while it slides; none while it is held at rest."""
    return ca.if_else(law.stuck, 0, ratio) if law.sets else ratio


def signum(x: SX) -> SX:
    """−1 for negative numbers, else +1."""
    return ca.if_else(x < 0, -1, 1)


@dataclass(frozen=True)
class ContactElement:
    """A kind of joint contact: what it is for scenes, pictures and tables, and its closed forms.

    sizes      its numbers in a scene.
    pairs      for every pair of sliding surfaces the freedoms along which it slides.
    bound      freedoms along which nothing slides and a force follows from what presses (teeth that push wheels apart).
    places     (sizes by label) → where its contacts sit, in order; contacts beyond them (a couple) have no place.
    pins       (sizes by label) → the pin or pins as drawn; ideal: the part they are drawn on in a joint without friction.
    anywhere   whether a contact can be anywhere on its circle; a sleeve's only change sides, a thread's are all around.
    needs      components of f_c, m_c the forms use, given the element's numbers (names) and whether it is ``adams``.
    friction   (wrench, rates, laws, numbers, adams) → friction on the inboard part along each freedom (η).
    speeds     (wrench, rates, laws, numbers, adams) → sliding speed of every pair, m/s, negative once past a reversal of the frozen
               direction.
    held       (wrench, direction of friction, laws, numbers, adams) → for every pair at rest what it can hold (``Hold``).
    contacts   (wrench, rates, laws, numbers, friction) → contacts; at rest they follow from the friction itself.
    pressed    (wrench, rates, laws, numbers) → components of what its contacts press, each times the root of its spring's
               compliance over that of one contact (METHOD, "Redundant loops"): without friction where ``laws`` is empty,
               else with that of sliding (a pair at rest counts as without). As many numbers either way; the
               wrench has all six components.
    rests      (numbers of a joint) → what each pair can hold at rest, as sums of norms of linear functions (``resting``).
    thrusts    components of f_c that faces across an axis carry.
    velocity   (rates, numbers) → velocity components of every pair (m/s; ball: rad/s).
    count      number of contacts; 0 for friction that does not follow what presses.
    springs    how many numbers ``pressed`` gives.
    drift      (wrench, rates, laws, numbers, adams) → rates of the states of a law that has them, along each freedom; without it
               they follow from ``velocity`` alone.
    cone       (as ``speeds``) → measure of sliding of a pair that can turn without sliding: negative where it does (ball).
    frame      axes of f_c, m_c: "pin" (the pin's joint frame), "inboard" (joint frame whose axes the rates have: ball), "both"
               (u1, u2, u1 × u2; then always the wrench on the inboard part).
    """

    name: str
    needs: Callable[[Sequence[str], bool], tuple[str, ...]]
    friction: Callable[[Wrench, list[SX], list[Law], Mapping[str, SX], bool], list[SX]]
    speeds: Callable[[Wrench, list[SX], list[Law], Mapping[str, SX], bool], list[SX]]
    held: Callable[[Wrench, list[SX], list[Law], Mapping[str, SX], bool], list[Hold]]
    contacts: Callable[[Wrench, list[SX], list[Law], Mapping[str, SX], list[SX]], list[Contact]]
    velocity: Callable[[list[SX], Mapping[str, SX]], list[list[SX]]]
    pressed: Callable[[Wrench, list[SX], list[Law], Mapping[str, SX]], list[SX]]
    count: int
    springs: int
    sizes: tuple[Size, ...]
    pairs: tuple[tuple[int, ...], ...]
    places: Callable[[Mapping[str, float]], list[Place]]
    pins: Callable[[Mapping[str, float]], list[Solid]]
    rests: Callable[[Rubs], list[Pair]]
    thrusts: tuple[str, ...] = ()
    anywhere: bool = True
    ideal: str = "pin"
    frame: str = "pin"
    bound: tuple[int, ...] = ()
    cone: Callable[[Wrench, list[SX], list[Law], Mapping[str, SX], bool], list[SX]] | None = None
    drift: Callable[[Wrench, list[SX], list[Law], Mapping[str, SX], bool], list[SX]] | None = None

    def __post_init__(self) -> None:
        """Refuse a declaration that does not fit together."""
        checked_numbers(f"contact element {self.name}", self.sizes)
        for wrong in self._mistakes():
            raise ValueError(f"contact element {self.name}: {wrong}")

    def _mistakes(self) -> list[str]:
        """What is wrong with the declaration."""
        found = []
        freedoms = [*(k for pair in self.pairs for k in pair), *self.bound]
        if not self.pairs or sorted(freedoms) != list(range(len(freedoms))):
            found.append("every freedom belongs to one sliding pair: pairs such as ((0,), (1,))")
        example = {label: 1.0 for s in self.sizes for label in s.labels}
        try:
            places, solids = self.places(example), self.pins(example)
        except KeyError as e:
            return [f"its places or pins ask for {e.args[0]}, which is none of its sizes"]
        if not int(self.anywhere and self.count > 0) <= len(places) <= self.count:
            found.append(f"{len(places)} places for {self.count} contacts")
        if not solids and self.count:
            found.append("it has no pin to draw")
        where: list[Place | Solid] = [*places, *solids]
        for x in where:
            if x.on not in PARTS or x.axis not in (0, 1, 2) or (isinstance(x, Place) and x.pair not in range(len(self.pairs))):
                found.append(f"there is no such part, axis or pair: {x}")
        if self.frame not in ("pin", "inboard", "both") or self.ideal not in PARTS:
            found.append(f"frame {self.frame!r} or ideal {self.ideal!r} is unknown")
        for adams in (False, True):
            if not {*self.needs(list(example), adams), *self.thrusts} <= {*COMPONENTS, SPAN}:
                found.append(f"needs or thrusts name components other than {', '.join(COMPONENTS)}")
        return found

    @property
    def elevates(self) -> bool:
        """Whether a contact normal can leave the plane of its angle (ball)."""
        return self.cone is not None

    def drifts(self, w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
        """Rates of the states of a law with bristles, 1/s, along each freedom."""
        if self.drift is not None:
            return self.drift(w, rates, laws, g, adams)
        pairs = zip(laws, self.velocity(rates, g), strict=True)
        return [x for law, v in pairs for x in law.drift(v, law.state)]
