"""Contact elements: closed forms that give contact forces, contact points and friction from a joint reaction.

f_c, m_c act on the part that carries the pin, in the pin's frame (notation, "Reactions, friction and contacts"). Derivation:
theory, "Contact forms". The file of an element has one function per field of ``ContactElement``; the contract of each function
is in the docstring of that class."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.basics.number_declarations import Number, checked_numbers
from trunnion.elements.contact.clearance import Play
from trunnion.elements.friction import Law

if TYPE_CHECKING:
    from trunnion.elements.contact.static_friction_capacity import Pair, Rubs

TINY = 1e-300
COMPONENTS = ("f1", "f2", "f3", "m1", "m2", "m3")


FIXED, OVERLAP = "fixed", "overlap"
"""Values for a joint's ``ends``: contacts are at the ends of one part, or at the ends of the overlap of both parts."""
SPAN = "span"
"""Name of the half length of the overlap of two parts of finite length, m. A wrench contains this length in addition to the
components of f_c, m_c."""


@dataclass(frozen=True)
class Wrench:
    """Wrench of a joint on the part with the pin. ``values`` contains, by name, the needed components of f_c (N) and m_c (N m), and
    SPAN. ``pin`` is +1 if the inboard part has the pin, −1 if the outboard part has it. Signed friction ratios are multiplied by
    ``pin``."""

    values: Mapping[str, SX]
    pin: int

    def __getitem__(self, name: str) -> SX:
        return self.values[name]


@dataclass(frozen=True)
class Contact:
    """One contact.

    force    normal force, N, ≥ 0
    vector   force times the outward unit normal on the pin (3 components); a contact without force needs no direction
    plane    indices of the axes for the cosine and the sine of the contact's angle
    inboard  whether ``vector`` and ``plane`` refer to the inboard joint frame; otherwise, to the pin's frame
    watched  vector that passes through zero when the contact changes sides; default: ``vector``. For teeth, the component of the
             force along the teeth's motion, because this force rotates by less than 180° when the teeth change flanks."""

    force: SX
    vector: tuple[SX, SX, SX]
    plane: tuple[int, int]
    inboard: bool = False
    watched: tuple[SX, SX, SX] | None = None


@dataclass(frozen=True)
class Size(Number):
    """A size of a contact element.

    drawn  default in pictures, relative to the mechanism's length
    bears  whether the spring forces (``ContactElement.pressed``) depend on this size
    ends   value of a joint's ``ends`` for which the size applies, FIXED or OVERLAP; "" for both
    """

    drawn: float = 0.025
    bears: bool = True
    ends: str = ""


PARTS = ("pin", "inboard", "outboard")


@dataclass(frozen=True)
class Place:
    """Position of a contact. The distance from the joint point is ``along`` (m) in the direction of joint axis ``axis`` (0, 1, 2)
    of the part ``on``, and ``arm`` (m) along the outward normal.

    on    "pin" for the part with the pin, or "inboard" or "outboard"
    pair  index of the friction pair, from 0
    area  projected bearing area, m²
    arc   surface per angle, m²/rad, of a contact that moves around the pin
    """

    on: str
    axis: int
    along: float
    arm: float
    pair: int = 0
    area: float = 0.0
    arc: float = 0.0


@dataclass(frozen=True)
class Solid:
    """A pin in pictures: "cylinder" (radius, length), "sphere" (radius) or "box" (three edges), m. The shape lies along joint axis
    ``axis`` of the part ``on``."""

    shape: str
    sizes: tuple[float, ...]
    on: str = "pin"
    axis: int = 0


@dataclass(frozen=True)
class Hold:
    """Static friction of a pair, as forces at the surface, N.

    capacity  largest friction force in the required direction
    size      required friction force; the friction ratio is size/capacity
    beyond    required part that no friction can supply (the torque about the force of a point contact)
    """

    capacity: SX
    size: SX
    beyond: SX | float = 0.0


HELD_MOST = 1.5
"""Limit of the friction ratio of a pair at rest in the computation of its contacts, relative to the static coefficient. (Only trial
solutions exceed the static coefficient; without a limit, their friction could be larger than any contact can carry.)"""


def ratio_held(load: Callable[[SX], SX], size: SX, static: SX, rounds: int = 6) -> SX:
    """Friction ratio |k| of a pair at rest: the root of k · load(k) = size, by unrolled Newton steps. The ratio is at most
    HELD_MOST · static. The product k · load(k) increases with k, and is smooth up to the limit of sticking, k = static (theory,
    "Rest")."""
    k, most = ca.SX.sym("k"), HELD_MOST * static
    size = ca.fmin(size, most * load(most))
    residual = k * load(k) - size
    step = k - residual / (ca.jacobian(residual, k) + TINY)
    out = size / (load(ca.SX(0)) + TINY)
    for _ in range(rounds):
        out = ca.substitute(step, k, out)
    return out


def signum(x: SX) -> SX:
    """−1 for negative numbers, otherwise +1."""
    return ca.if_else(x < 0, -1, 1)


@dataclass(frozen=True)
class SinglePair:
    """A contact with a single pair, which slides along a line.

    velocity  as in ``ContactElement``
    load      (wrench, friction ratio k, numbers, adams) → load to which friction is proportional, N
    force     (η, numbers) → magnitude of the friction force along the line, N
    """

    velocity: Callable[[list[SX], Mapping[str, SX]], list[list[SX]]]
    load: Callable[[Wrench, SX, Mapping[str, SX], bool], SX]
    force: Callable[[SX, Mapping[str, SX]], SX]

    def ratio(self, w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX]) -> SX:
        """Friction ratio of the sliding pair."""
        return w.pin * laws[0].ratios(self.velocity(rates, g)[0])[0]

    def held(self, w: Wrench, u: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[Hold]:
        """``Hold`` of the pair at rest. The capacity is μ_static · load(μ_static), because |k| = μ_static is the largest ratio at
        rest (theory, "Rest")."""
        most = laws[0].static
        return [Hold(most * self.load(w, w.pin * most * signum(u[0]), g, adams), self.force(u[0], g))]

    def ratio_now(self, w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> SX:
        """Friction ratio of the sliding pair, or of the pair at rest with the friction η."""
        k = self.ratio(w, rates, laws, g)
        if not (laws[0].sets and eta):
            return k
        side = w.pin * signum(eta[0])
        still = ratio_held(lambda x: self.load(w, side * x, g, False), self.force(eta[0], g), laws[0].static)
        return ca.if_else(laws[0].stuck, side * still, k)


@dataclass(frozen=True)
class ContactElement:
    """A kind of joint contact: closed forms, and data for scenes, pictures and tables. In the arguments below, numbers are sizes
    and law parameters by name; adams: whether Adams' form applies.

    sizes      numbers of the element in a scene.
    pairs      for each friction pair, the indices of the freedoms along which it slides.
    bound      freedoms without sliding whose force follows from contact forces (teeth that push wheels apart).
    places     (sizes by label) → positions of the first contacts, in order; the remaining contacts (a couple) have no position.
    pins       (sizes by label) → pins for pictures.
    ideal      the part with the pin in pictures of a joint without friction.
    anywhere   whether a contact can be at any angle. False for a sleeve (contacts on either side) and a thread (all around).
    needs      (names of numbers, adams) → names of the components of f_c, m_c that the closed forms use.
    friction   (wrench, rates, laws, numbers, adams) → friction on the inboard part along each freedom (η).
    own_speeds (wrench, rates, laws, numbers, adams) → sliding speed of each pair; default: from ``velocity``, one component each.
    held       (wrench, required friction, laws, numbers, adams) → ``Hold`` of each pair at rest.
    contacts   (wrench, rates, laws, numbers, friction) → contacts; for a pair at rest they follow from the friction.
    pressed    (wrench with six components, rates, laws, numbers, friction) → components of contact forces, each times
               √(compliance of its spring / compliance of one contact) (theory, "Redundant loops"). Friction rotates the normals
               of these forces: in a sliding pair by its law, in a pair at rest by ``friction``. With empty ``laws``, all friction
               is omitted; with empty ``friction``, friction at rest.
    rests      (numbers of a joint) → static capacity of each pair (``static_friction_capacity``).
    thrusts    names of the components of f_c that end faces normal to an axis carry.
    velocity   (rates, numbers) → velocity components of each pair (m/s; ball: rad/s).
    one_of     names of sizes; a scene gives exactly one of them.
    tensions   (η along the first freedom, numbers) → tensions at both ends of a band, N, as expressions or plain numbers; None
               if there is no band.
    separation (numbers) → force along the bound freedom divided by the magnitude of the driving force, for teeth; else None. The
               driving force is a multiplier of the loop constraints times a constant.
    scaled     for elements without contacts: whether the law's coefficient scales the friction that other numbers give, and is 1
               by default.
    count      number of contacts; 0 if friction is independent of the load.
    springs    number of entries that ``pressed`` returns.
    drift      (wrench, rates, laws, numbers, adams) → rates of bristle states along each freedom; default: from ``velocity``.
    cone       (arguments of ``own_speeds``) → for each pair, a number that is negative while the pair turns without sliding. Only
               the ball has this function; other elements have None.
    frame      axes of f_c, m_c: "pin" (the pin's joint frame); "inboard" (the joint frame of the rates, for a ball); "both" (u1,
               u2, u1 × u2, with the wrench on the inboard part).
    plays      clearances of the element, in which ``knocks`` computes crossings."""

    name: str
    needs: Callable[[Sequence[str], bool], tuple[str, ...]]
    friction: Callable[[Wrench, list[SX], list[Law], Mapping[str, SX], bool], list[SX]]
    held: Callable[[Wrench, list[SX], list[Law], Mapping[str, SX], bool], list[Hold]]
    contacts: Callable[[Wrench, list[SX], list[Law], Mapping[str, SX], list[SX]], list[Contact]]
    velocity: Callable[[list[SX], Mapping[str, SX]], list[list[SX]]]
    pressed: Callable[[Wrench, list[SX], list[Law], Mapping[str, SX], list[SX]], list[SX]]
    count: int
    springs: int
    sizes: tuple[Size, ...]
    pairs: tuple[tuple[int, ...], ...]
    rests: Callable[[Rubs], list[Pair]]
    places: Callable[[Mapping[str, float]], list[Place]] = lambda g: []
    pins: Callable[[Mapping[str, float]], list[Solid]] = lambda g: []
    own_speeds: Callable[[Wrench, list[SX], list[Law], Mapping[str, SX], bool], list[SX]] | None = None
    thrusts: tuple[str, ...] = ()
    anywhere: bool = True
    ideal: str = "pin"
    frame: str = "pin"
    bound: tuple[int, ...] = ()
    plays: tuple[Play, ...] = ()
    one_of: tuple[str, ...] = ()
    tensions: Callable[[Any, Mapping[str, Any]], list[Any]] | None = None
    separation: Callable[[Mapping[str, float]], float] | None = None
    scaled: bool = True
    cone: Callable[[Wrench, list[SX], list[Law], Mapping[str, SX], bool], list[SX]] | None = None
    drift: Callable[[Wrench, list[SX], list[Law], Mapping[str, SX], bool], list[SX]] | None = None

    def __post_init__(self) -> None:
        """Check the declaration. Raises ValueError if the declaration is inconsistent."""
        checked_numbers(f"contact element {self.name}", self.sizes)
        for wrong in self._mistakes():
            raise ValueError(f"contact element {self.name}: {wrong}")

    def _mistakes(self) -> list[str]:
        """Faults of the declaration."""
        found = []
        freedoms = [*(k for pair in self.pairs for k in pair), *self.bound]
        if not self.pairs or sorted(freedoms) != list(range(len(freedoms))):
            found.append("every freedom belongs to one sliding pair: pairs such as ((0,), (1,))")
        example = {label: 1.0 for s in self.sizes for label in s.labels}
        try:
            places, solids = self.places(example), self.pins(example)
        except KeyError as e:
            return [f"its places or pins use {e.args[0]}, which is not one of its sizes"]
        if not int(self.anywhere and self.count > 0) <= len(places) <= self.count:
            found.append(f"{len(places)} places for {self.count} contacts")
        if not solids and self.count:
            found.append("it has no pin to draw")
        where: list[Place | Solid] = [*places, *solids]
        for x in where:
            if x.on not in PARTS or x.axis not in (0, 1, 2) or (isinstance(x, Place) and x.pair not in range(len(self.pairs))):
                found.append(f"unknown part, axis or pair: {x}")
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

    def speeds(self, w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
        """Sliding speed of every pair, m/s. The speed is negative if the velocity has reversed relative to the frozen direction."""
        if self.own_speeds is not None:
            return self.own_speeds(w, rates, laws, g, adams)
        return [ca.fabs(v[0]) * law.sign(v, (1.0,)) for v, law in zip(self.velocity(rates, g), laws, strict=True)]

    def drifts(self, w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
        """Rates of the states of a law with bristles, 1/s, along each freedom."""
        if self.drift is not None:
            return self.drift(w, rates, laws, g, adams)
        pairs = zip(laws, self.velocity(rates, g), strict=True)
        return [x for law, v in pairs for x in law.drift(v, law.state)]
