"""Catalogue of the primitives that an installation precompiles. Scenes that need only these primitives need no compiler.

The declarations of joint types, contact elements, laws and columns determine the catalogue. It omits rare cases: two prescribed
freedoms of a planar joint; one or two prescribed freedoms of a free body; Adams' approximation with laws other than ``COMPARED``;
friction on redundant loops of joints with a stiffness; constant friction and preloads with laws that are not set-valued; threads
with unusual laws; rotors, except on hinges, guides and balls."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain, combinations, product
from typing import Any

from trunnion.basics.number_declarations import Number
from trunnion.columns.declaration import ColumnKind
from trunnion.columns.operands import CONTACT_REACTION, FRICTION, JOINT_MULTIPLIERS, JOINT_RATES, REACTION_ARM
from trunnion.columns.registry import CONTACT, REGISTRY
from trunnion.elements.contact import GIVEN, element_of
from trunnion.elements.contact import REGISTRY as CONTACTS
from trunnion.elements.contact.contact_element import FIXED, OVERLAP
from trunnion.elements.contact.gearbox_losses import EFFICIENCY, TABLES, table_labels
from trunnion.elements.contact.journal import PRELOAD
from trunnion.elements.contact.registry import preloads
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.elements.friction.coulomb import BY_SPEED, Coulomb
from trunnion.elements.joints import REGISTRY as JOINTS
from trunnion.elements.joints import JointKind
from trunnion.elements.joints.mimic_and_light_rows import MIMIC
from trunnion.parts.primitives.primitive_keys import BARE, PIN_IN, PIN_OUT, BodyKey, FrictionKey, ParameterCounter, sized
from trunnion.scene.force_laws.registry import REGISTRY as FORCE_LAWS
from trunnion.scene.signals.registry import REGISTRY as KINDS
from trunnion.scene.signals.time_formulas import OPERATIONS
from trunnion.system.structure.bodies_and_joints import Fit, FrictionElement, Joint, Slider
from trunnion.system.structure.friction_joint_indices import everything

Recipe = tuple[Any, ...]
"""Module, function and arguments of a primitive (``primitive_cache.primitive``)."""
MANY = 3
"""Number of a joint's freedoms. With fewer freedoms, the catalogue allows any subset as prescribed. With this number of freedoms,
the catalogue allows none, one or all; with more, none or all."""
COMPARED = {name for law in LAWS.values() if law.exact for name in (law.name, law.exact)}
"""Laws that the catalogue combines with Adams' approximation: each law that smooths another law, and the smoothed law."""
SIDES = (False, True)
PINS = (PIN_IN, PIN_OUT)
SIGNALS = [(kind.drives is None, not kind.loads, label) for kind in KINDS.values() for label in kind.labels]
DRIVES, LOADS = [label for drives, _, label in SIGNALS if drives], [*(label for _, loads, label in SIGNALS if loads), "through"]
"""Labels of the signals of drives, then of loads."""


def every() -> Iterator[Recipe]:
    """All recipes without repetition, followed by the recipes of the tangents that Jacobian units and linear units use."""
    recipes = dict.fromkeys(chain(_small(), _columns(), _bodies(), _cuts(), _frictions()))
    yield from recipes
    yield from (
        ("primitive_derivatives", "tangent", module, name, tuple(which), False)
        for module, name, *which in recipes
        if _smooth(name, which)
    )
    residuals = (which for _, name, *which in recipes if name == "residual")
    followed = [tuple(which) for which in residuals if _follows(which[0])]
    yield from (("primitive_derivatives", "tangent", "friction", "residual", which, True) for which in followed)


SMOOTH = {
    "signal", "limit", "operation", "time", "place", "at_least", "motor", "quaternion", "outboard", "weighed", "sprung", "pin",
    "drift", "residual", "pressed", "outward", "moved", "turned", "weigh", "carry", "energies", "along", "over", "span",
}  # fmt: skip
"""Functions whose primitives have tangents for all their arguments."""


FORCES = {"device", "load", "spring", "bushing", "latch", "along_freedom", "between_points"}
"""Functions whose primitives have tangents unless they compute powers, depths or positions."""


def _smooth(name: str, which: Sequence[Any]) -> bool:
    """Whether the catalogue contains tangents of a primitive. Contact columns have tangents only with the usual laws. (The tangents
    of contact columns have as much code as all other primitives together, and users seldom linearise contact columns.)"""
    if name == "column":
        friction = next((x.joint.friction for x in which[1] if isinstance(x, FrictionKey)), None)
        return not friction or (friction.law in COMPARED and not friction.adams)
    forces = name in FORCES and which[-1] not in ("power", "depths", "position")
    return name in SMOOTH or forces or (name == "cut" and which[-1] != "closed") or (name == "tie" and which[-1] != MIMIC.name)


def _follows(which: FrictionKey) -> bool:
    """Whether the catalogue supports friction parameters that depend on time in stiff motions: only for Coulomb's law with a
    coefficient that does not depend on speed."""
    friction = which.joint.friction
    return friction is not None and friction.law == Coulomb.name and not friction.adams and not friction.has(BY_SPEED[0][0])


def _small() -> Iterator[Recipe]:
    signals = [(kind, moves) for moves, kinds in ((True, DRIVES), (False, LOADS)) for kind in kinds]
    yield from (("signals_loads_energies", "signal", *each) for each in signals)
    yield from (("signals_loads_energies", "operation", *each) for each in product(OPERATIONS, (1, 3)))
    yield from (("signals_loads_energies", name) for name in ("limit", "time", "place"))
    yield from (("joint_devices", "device", what) for what in ("force", "power", "potential"))
    yield from (("signals_loads_energies", *each) for each in product(("spring", "bushing"), ("wrench", "power", "potential")))
    yield from (("signals_loads_energies", "load", *each) for each in product(("force", "torque"), SIDES, ("wrench", "power")))
    yield from (("signals_loads_energies", "load", "drag", False, what) for what in ("wrench", "power"))
    yield from (("joint_devices", end, upper) for end in ("depth", "push") for upper in SIDES)
    yield from (("joint_devices", "latch", what) for what in ("force", "power", "potential", "depths"))
    yield "joint_devices", "motor"
    for law in FORCE_LAWS.values():
        more = ("potential" if law.elastic else "power", *(("position",) if law.pieces else ()))
        yield from (("force_laws", "along_freedom", law.key, what) for what in ("force", *more) if law.data)
        yield from (("force_laws", "between_points", law.key, what) for what in ("wrench", "force", *more))
    plain = ("energies", "at_least", "quaternion", "over", "span")
    yield from (("signals_loads_energies", name) for name in plain)
    alone = [k.name for k in JOINTS.values() if k.nv == k.nq == 1 and not k.bodiless]
    yield from (("loop_joints_and_reactions", "tie", *both, MIMIC.name) for both in product(alone, alone))
    shafts = [name for name in alone if JOINTS[name].turns(0)]
    geared = [k.name for k in JOINTS.values() if k.follows == "freedom"]
    yield from (("loop_joints_and_reactions", "tie", *each) for each in product(shafts, shafts, geared))
    yield from (("loop_joints_and_reactions", "outboard", forward) for forward in SIDES)
    yield from (("loop_joints_and_reactions", "weighed", sign) for sign in (1, -1))
    yield from (("loop_joints_and_reactions", "arm", bodies) for bodies in (1, 2))
    yield from (("inverse_dynamics", "weigh", sign) for sign in (1, -1))


def _columns() -> Iterator[Recipe]:
    """Columns with an expression, except those of a joint's friction (``_contacts``)."""
    for kind in REGISTRY.values():
        if not kind.selects and FRICTION not in kind.operands.values():
            arms = [PINS if o is REACTION_ARM else (None,) for o in kind.operands.values()]
            yield from (("column_primitives", "column", kind.name, structures) for structures in product(*arms))


def _contacts(which: FrictionKey, column: ColumnKind = CONTACT) -> Recipe:
    """Contact columns of a joint with this friction, or another column of the joint's friction."""
    joint = which.joint
    nv, reaction = joint.kind.nv, len(everything(joint))
    sizes = {CONTACT_REACTION: reaction, JOINT_RATES: nv, JOINT_MULTIPLIERS: nv, FRICTION: which}
    return "column_primitives", "column", column.name, tuple(sizes.get(o) for o in column.operands.values())


def driven(kind: JointKind) -> list[tuple[int, ...]]:
    """Sets of freedoms of a joint that may be prescribed together. A bodiless joint has only the empty set."""
    if kind.bodiless:
        return [()]
    able = [k for k in range(kind.nv) if kind.coordinate_of(k) >= 0]
    counts = {0, 1, len(able)} if kind.nv == MANY else {0, len(able)} if kind.nv > MANY else range(len(able) + 1)
    return list(dict.fromkeys(chain.from_iterable(combinations(able, n) for n in sorted(counts))))


def _bodies() -> Iterator[Recipe]:
    for kind, forward in product([k for k in JOINTS.values() if not k.bodiless], SIDES):
        for which, how in product(driven(kind), ((), (True,), (True, True))):
            yield "body_step", "body_primitive", BodyKey(kind.name, forward, which, *how)
            if spun(kind, which):
                yield "body_step", "body_primitive", replace(BodyKey(kind.name, forward, which, *how), rotors=True)
        for which in driven(kind):
            plain = BodyKey(kind.name, forward, which)
            yield from (("inverse_dynamics", name, plain) for name in ("outward", "moved", "turned", "carry"))
            yield "primitive_derivatives", "solving", plain
            if spun(kind, which):
                yield "primitive_derivatives", "solving", replace(plain, rotors=True)
        yield from (("signals_loads_energies", "along", kind.name, forward, k) for k in range(kind.nv))


def spun(kind: JointKind, which: tuple[int, ...]) -> bool:
    """Whether the catalogue contains primitives with rotors for a joint of this type, with the freedoms ``which`` prescribed. A
    rotor adds an inertia along a freedom. Every free freedom may have a rotor, because the freedom may be light. Prescribed
    freedoms may have a rotor on hinges, guides and balls only, for motors and imported files."""
    plain = kind.nv in (1, MANY) and len({kind.turns(k) for k in range(kind.nv)}) == 1 and not kind.pitched
    return plain or len(which) < kind.nv


def _cuts() -> Iterator[Recipe]:
    for kind in JOINTS.values():
        if kind.cuttable and kind.follows != "freedom":
            variants = ("",) if kind.slips else BARE
            yield from (("loop_joints_and_reactions", "cut", kind.name, *each) for each in product(("", "inb", "out"), variants))
        if kind.follows and kind.follows != "freedom":
            yield from (("loop_joints_and_reactions", "bearing", kind.name, ground) for ground in ("", "inb", "out"))
        for fit, soft, which in product(fits(kind), SIDES, driven(kind)):
            yield "loop_joints_and_reactions", "sprung", kind.name, fit, (), soft, which


def _frictions() -> Iterator[Recipe]:
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
            for law, other in product((law for law in LAWS if LAWS[law].sets), (kind.loaded, kind.banded)):
                for names in numbers(law, other) if other and other != kind.friction else ():
                    for pin_out in SIDES[: 1 + bool(CONTACTS[other].needs(names, False))]:
                        yield from _rubbing(_of(kind, other, law, False, Fit(pin_out), names))


def _laws(kind: JointKind) -> list[str]:
    """Friction laws that the catalogue contains for joints of this type."""
    return [name for name, law in LAWS.items() if usual(name) or not (kind.pitched or kind.bodiless)]


def usual(law: str) -> bool:
    """Whether the catalogue also contains this law for pitched and bodiless joints: set-valued laws, and the laws in
    ``COMPARED``."""
    return LAWS[law].sets or law in COMPARED


def fits(kind: JointKind, pins: Sequence[bool] = SIDES) -> list[Fit]:
    """All fits of a joint. A fit states which part is inside, and which part has the ends of the contact."""
    pins = pins[:1] if kind.bodiless else pins
    ends = ("pin", "bearing") if kind.slides_along >= 0 and overlaps(kind) else ("pin",)
    return [Fit(*each) for each in product(pins, ends)]


def overlaps(kind: JointKind) -> bool:
    """Whether the parts of joints of this type may touch along an overlap."""
    return bool(kind.friction) and any(s.ends == OVERLAP for s in CONTACTS[kind.friction].sizes)


def numbers(law: str, contact: str, adams: bool = False, ends: str = FIXED) -> list[tuple[str, ...]]:
    """Sets of friction parameters that a scene may give. Each set contains all required parameters and a subset of the optional
    parameters."""
    usual = LAWS[law].sets and not adams
    sizes = [s for s in CONTACTS[contact].sizes if s.ends in ("", ends)]
    declared = [*LAWS[law].numbers, *(s for s in sizes if usual or s.name != PRELOAD.name)]
    always = {n.name for n in declared if preloads(n, law, adams)}
    found = [tuple(label for n in given for label in n.labels) for given in _given(declared, always)]
    if one := set(CONTACTS[contact].one_of):
        found = [names for names in found if len(one & set(names)) == 1]
    if not usual or law != Coulomb.name:
        return found
    curve = ("mu", *(name for pair in BY_SPEED for name in pair))
    return [*found, *(each for names in found if "mu_static" not in names for each in ((*curve, *names[1:]), *_tabled(names)))]


def _tabled(names: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    """The parameters, with tables in place of the numbers that may be tables. In a set, all tables are over load, or all are over
    speed."""
    tables = {s.name for c in CONTACTS.values() for s in c.sizes if s.by_load} & set(names)
    for over, some in product(TABLES, ({EFFICIENCY.name}, tables)):
        if some <= tables:
            yield tuple(x for n in names for x in (chain.from_iterable(table_labels(n, over)) if n in some else (n,)))


def _given(declared: Sequence[Number], always: set[str]) -> Iterator[list[Number]]:
    """All required parameters and those in ``always``, with each subset of the optional parameters. A parameter with
    ``needed_with`` is included together with the parameter named there."""
    loose = [n for n in declared if not n.needed and n.default is None and not n.needed_with and n.name not in always]
    for some in chain.from_iterable(combinations(loose, k) for k in range(len(loose) + 1)):
        names = {n.name for n in some}
        names |= always
        yield [n for n in declared if n.needed or n.default is not None or n.name in names or n.needed_with in names]


def _of(kind: JointKind, element: str, law: str, adams: bool, fit: Fit, names: tuple[str, ...]) -> FrictionKey:
    contact, own = CONTACTS[element], ParameterCounter()
    names += ("pitch",) * kind.pitched + ("module", "side", "first") * (kind.rolls is not None)
    names += ("lead_angle",) * (kind.rolls is not None and kind.rolls.touch == "skew")
    names += ("ratio",) * (kind.follows == "freedom")
    sliders = tuple(Slider(i, pair, str(i + 1)) for i, pair in enumerate(contact.pairs))
    friction = FrictionElement(contact.name, law, adams, tuple((name, own.take_one()) for name in names), sliders, contact.bound)
    joint = Joint("", kind.name, 0, 0, (), (), (), (), fit, None, (), friction, False, 0, True)
    return FrictionKey(joint, contact.needs(names, adams))


def _rubbing(which: FrictionKey) -> Iterator[Recipe]:
    joint, friction = which.joint, which.joint.friction
    assert friction is not None
    kind, law = joint.kind, LAWS[friction.law]
    yield from (("friction", name, which, alone) for name in ("law", *(["held"] if law.sets else [])) for alone in SIDES)
    yield "friction", "residual", which
    if CONTACTS[friction.contact].count:
        yield "friction", "pressed", which, False
        yield _contacts(which)
    if CONTACTS[friction.contact].tensions:
        yield _contacts(which, REGISTRY["band_tension"])
    if law.bristles:
        yield "friction", "drift", which
    if not which.needs:
        return  # a given friction force needs no reactions
    names = tuple(name for name, _ in friction.numbers if name in sized(friction.contact))
    for fit in [joint.fit] if joint.fit.ends == OVERLAP else fits(kind, (joint.fit.pin_out,)):
        yield from _pinned(which, fit)
        for soft, moved in product(SIDES, driven(kind)):
            yield "loop_joints_and_reactions", "sprung", kind.name, fit, names, soft, moved


def _pinned(which: FrictionKey, fit: Fit) -> Iterator[Recipe]:
    """Primitives that convert reactions into the components that contact elements need."""
    kind = which.joint.kind
    yield from (("loop_joints_and_reactions", "pin", kind.name, fit, needs) for needs in (which.needs, everything(which.joint)))
    for forward in SIDES:
        yield "signals_loads_energies", "pin", kind.name, forward, fit, which.needs
        for moved in driven(kind):
            free = tuple(k for k in range(kind.nv) if k not in moved)
            yield "friction", "grip", kind.name, forward, fit, which.needs, free
