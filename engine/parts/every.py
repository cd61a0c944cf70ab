"""Every part that a scene may be made of: what the build hook compiles, so that an installed Trunnion compiles nothing.

The list follows from what joint types, contact elements and laws declare, so that a new one is in it. Left out is what hardly a
scene has: of a planar joint two freedoms prescribed, of a free body one or two; Adams' approximation with laws that it is not
compared with; friction in redundant loops of joints that say their stiffness; friction that is given and preloads with laws that
are not set-valued, threads with laws that are not usual, rotors but of hinges, guides and balls."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain, combinations, product
from typing import Any

from engine.basics.numbers import Number
from engine.contact import GIVEN, element_of
from engine.contact import REGISTRY as CONTACTS
from engine.contact.base import FIXED, OVERLAP
from engine.contact.journal import PRELOAD
from engine.contact.registry import preloads
from engine.friction import REGISTRY as LAWS
from engine.friction.coulomb import BY_SPEED, Coulomb
from engine.joints import REGISTRY as JOINTS
from engine.joints import JointKind
from engine.parts.known import BARE, Carried, Numbers, Rubbing, sized
from engine.system.elements import everything
from engine.system.profiles import MOVES
from engine.system.structure import Fit, FrictionElement, Joint, Slider

Asked = tuple[Any, ...]
"""Module, function and arguments of a part (``store.part``)."""
MANY = 3
"""Freedoms of a joint from which on one, all or none of them may be driven (of more than these all or none); of fewer any."""
COMPARED = {name for law in LAWS.values() if law.exact for name in (law.name, law.exact)}
"""Laws with which Adams' approximation of normal forces is compared: one that smooths another, and that."""
SIDES = (False, True)
DRIVES, LOADS = ("rate", "ramp", "begun", "harmonic", *MOVES), ("ramp", "begun", "harmonic", "through")


def every() -> Iterator[Asked]:
    """All of them, each once, and the tangents of those that Jacobians and linear units are made of."""
    told = dict.fromkeys(chain(_small(), _bodies(), _cuts(), _frictions()))
    yield from told
    yield from (("tangents", "tangent", module, name, tuple(which), False) for module, name, *which in told if _smooth(name, which))
    residuals = (which for _, name, *which in told if name == "residual")
    yield from (("tangents", "tangent", "friction", "residual", tuple(which), True) for which in residuals if _follows(which[0]))


SMOOTH = {
    "signal", "at_least", "motor", "quaternion", "outboard", "weighed", "sprung", "pin", "drift", "residual", "pressed", "outward",
    "moved", "turned", "weigh", "carry", "energies", "point", "acceleration", "orientation", "along", "over", "reaction",
    "span",
}  # fmt: skip
"""Functions that write parts of which Jacobians and linear units need tangents, whatever they are asked for."""


def _smooth(name: str, which: Sequence[Any]) -> bool:
    """Whether there are tangents of a part. Those of contacts have as much code as all others, for columns that are seldom
    linearised: there are those of the usual laws."""
    if name == "contacts":
        friction = which[0].joint.friction
        return friction.law in COMPARED and not friction.adams
    forces = name in ("device", "load", "spring", "bushing", "latch") and which[-1] not in ("power", "depths")
    return name in SMOOTH or forces or (name == "cut" and which[-1] != "closed")


def _follows(which: Rubbing) -> bool:
    """Whether numbers of such friction may follow time where motions are stiff: with the usual law, without the many of a curve."""
    friction = which.joint.friction
    return friction is not None and friction.law == Coulomb.name and not friction.adams and not friction.has(BY_SPEED[0][0])


def _small() -> Iterator[Asked]:
    yield from (("small", "signal", kind, moves) for moves, kinds in ((True, DRIVES), (False, LOADS)) for kind in kinds)
    yield from (("devices", "device", what) for what in ("force", "power", "potential"))
    yield from (("small", "spring", what) for what in ("wrench", "power", "potential", "line"))
    yield from (("small", "bushing", what) for what in ("wrench", "power", "potential", "state"))
    yield from (("small", "load", *each) for each in product(("force", "torque"), SIDES, ("wrench", "power")))
    yield from (("devices", end, upper) for end in ("depth", "push") for upper in SIDES)
    yield from (("devices", "latch", what) for what in ("force", "power", "potential", "depths"))
    yield "devices", "motor"
    plain = ("energies", "at_least", "quaternion", "point", "acceleration", "orientation", "over", "span")
    yield from (("small", name) for name in plain)
    alone = [k.name for k in JOINTS.values() if k.nv == k.nq == 1 and not k.bodiless]
    yield from (("closing", "tie", *both) for both in product(alone, alone))
    yield from (("closing", "outboard", forward) for forward in SIDES)
    yield from (("closing", "reaction", pin_out) for pin_out in SIDES)
    yield from (("closing", "weighed", sign) for sign in (1, -1))
    yield from (("closing", "arm", bodies) for bodies in (1, 2))
    yield from (("inverse", "weigh", sign) for sign in (1, -1))


def driven(kind: JointKind) -> list[tuple[int, ...]]:
    """Which freedoms of a joint may be prescribed together; of what carries no body none."""
    if kind.bodiless:
        return [()]
    able = [k for k in range(kind.nv) if kind.coordinate_of(k) >= 0]
    counts = {0, 1, len(able)} if kind.nv == MANY else {0, len(able)} if kind.nv > MANY else range(len(able) + 1)
    return list(dict.fromkeys(chain.from_iterable(combinations(able, n) for n in sorted(counts))))


def _bodies() -> Iterator[Asked]:
    for kind, forward in product([k for k in JOINTS.values() if not k.bodiless], SIDES):
        for which, how in product(driven(kind), ((), (True,), (True, True))):
            yield "body", "body_part", Carried(kind.name, forward, which, *how)
            if spun(kind):
                yield "body", "body_part", replace(Carried(kind.name, forward, which, *how), rotors=True)
        for which in driven(kind):
            plain = Carried(kind.name, forward, which)
            yield from (("inverse", name, plain) for name in ("outward", "moved", "turned", "carry"))
            yield "tangents", "solving", plain
            if spun(kind):
                yield "tangents", "solving", replace(plain, rotors=True)
        yield from (("small", "along", kind.name, forward, k) for k in range(kind.nv))


def spun(kind: JointKind) -> bool:
    """Whether joints of this type have rotors, as motors and other programs' files have them: hinges, guides, balls."""
    return kind.nv in (1, MANY) and len({kind.turns(k) for k in range(kind.nv)}) == 1 and not kind.pitched


def _cuts() -> Iterator[Asked]:
    for kind in JOINTS.values():
        if kind.cuttable:
            yield from (("closing", "cut", kind.name, *each) for each in product(("", "inb", "out"), BARE))
        if kind.follows:
            yield from (("closing", "bearing", kind.name, ground) for ground in ("", "inb", "out"))
        for fit, soft, which in product(fits(kind), SIDES, driven(kind)):
            yield "closing", "sprung", kind.name, fit, (), soft, which


def _frictions() -> Iterator[Asked]:
    for kind in JOINTS.values():
        if kind.friction:
            given = element_of("", kind.freely_rubbed, GIVEN)
            for law, adams, pin_out in product(_laws(kind), SIDES, SIDES[: 1 if kind.bodiless else 2]):
                for names in numbers(law, kind.friction, adams) if law in COMPARED or not adams else ():
                    yield from _rubbing(_of(kind, kind.friction, law, adams, Fit(pin_out), names))
                for names in numbers(law, kind.friction, adams, OVERLAP) if LAWS[law].sets and not adams and overlaps(kind) else ():
                    yield from _rubbing(_of(kind, kind.friction, law, adams, Fit(pin_out, OVERLAP), names))
            for law in (law for law in LAWS if given and LAWS[law].sets):
                yield from (x for names in numbers(law, given) for x in _rubbing(_of(kind, given, law, False, Fit(), names)))


def _laws(kind: JointKind) -> list[str]:
    """The laws that friction of a joint usually has."""
    return [name for name, law in LAWS.items() if usual(name) or not (kind.pitched or kind.bodiless)]


def usual(law: str) -> bool:
    """Whether a law is one that threads, seals and finite parts have, too: the set-valued ones and those compared with them."""
    return LAWS[law].sets or law in COMPARED


def fits(kind: JointKind, pins: Sequence[bool] = SIDES) -> list[Fit]:
    """Which part may be inside, and which may have the ends."""
    pins = pins[:1] if kind.bodiless else pins
    ends = ("pin", "bearing") if kind.slides_along >= 0 and overlaps(kind) else ("pin",)
    return [Fit(*each) for each in product(pins, ends)]


def overlaps(kind: JointKind) -> bool:
    """Whether parts of such joints may touch where they overlap."""
    return bool(kind.friction) and any(s.ends == OVERLAP for s in CONTACTS[kind.friction].sizes)


def numbers(law: str, contact: str, adams: bool = False, ends: str = FIXED) -> list[tuple[str, ...]]:
    """The numbers that friction of a joint may be told by: all that are needed, and any others."""
    usual = LAWS[law].sets and not adams
    sizes = [s for s in CONTACTS[contact].sizes if s.ends in ("", ends)]
    declared = [*LAWS[law].numbers, *(s for s in sizes if usual or s.name != PRELOAD.name)]
    always = {n.name for n in declared if preloads(n, law, adams)}
    found = [tuple(label for n in given for label in n.labels) for given in _given(declared, always)]
    if not usual or law != Coulomb.name:
        return found
    curve = ("mu", *(name for pair in BY_SPEED for name in pair))
    return [*found, *((*curve, *names[1:]) for names in found if "mu_static" not in names)]


def _given(declared: Sequence[Number], always: set[str]) -> Iterator[list[Number]]:
    """What is needed, or there always, with any of the others; a number that is needed beside one of these comes with it, and is
    idle without it."""
    loose = [n for n in declared if not n.needed and n.default is None and not n.needed_with and n.name not in always]
    for some in chain.from_iterable(combinations(loose, k) for k in range(len(loose) + 1)):
        names = {n.name for n in some}
        names |= always
        yield [n for n in declared if n.needed or n.default is not None or n.name in names or n.needed_with in names]


def _of(kind: JointKind, element: str, law: str, adams: bool, fit: Fit, names: tuple[str, ...]) -> Rubbing:
    contact, own = CONTACTS[element], Numbers()
    names += ("pitch",) * kind.pitched + ("module", "side", "first") * (kind.rolls is not None)
    sliders = tuple(Slider(i, pair, str(i + 1)) for i, pair in enumerate(contact.pairs))
    friction = FrictionElement(contact.name, law, adams, tuple((name, own.one()) for name in names), sliders, contact.bound)
    joint = Joint("", kind.name, 0, 0, (), (), (), (), fit, None, (), friction, False, 0, True)
    return Rubbing(joint, contact.needs(names, adams))


def _rubbing(which: Rubbing) -> Iterator[Asked]:
    joint, friction = which.joint, which.joint.friction
    assert friction is not None
    kind, law = joint.kind, LAWS[friction.law]
    yield from (("friction", name, which, alone) for name in ("law", *(["held"] if law.sets else [])) for alone in SIDES)
    yield "friction", "residual", which
    if CONTACTS[friction.contact].count:
        yield "friction", "pressed", which, False
        yield "friction", "contacts", which
    if law.bristles:
        yield "friction", "drift", which
    if not CONTACTS[friction.contact].count:
        return  # what is given needs no reactions
    names = tuple(name for name, _ in friction.numbers if name in sized(friction.contact))
    for fit in [joint.fit] if joint.fit.ends == OVERLAP else fits(kind, (joint.fit.pin_out,)):
        yield from _pinned(which, fit)
        for soft, moved in product(SIDES, driven(kind)):
            yield "closing", "sprung", kind.name, fit, names, soft, moved


def _pinned(which: Rubbing, fit: Fit) -> Iterator[Asked]:
    """What turns reactions into those that contact forms are given."""
    kind = which.joint.kind
    yield from (("closing", "pin", kind.name, fit, needs) for needs in (which.needs, everything(which.joint)))
    for forward in SIDES:
        yield "small", "pin", kind.name, forward, fit, which.needs
        for moved in driven(kind):
            free = tuple(k for k in range(kind.nv) if k not in moved)
            yield "friction", "grip", kind.name, forward, fit, which.needs, free
