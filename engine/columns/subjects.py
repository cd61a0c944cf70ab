"""Subjects of columns: bodies, joints, freedoms, loads, the system. Each subject has words that fill the templates of names and
units."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.contact import REGISTRY as CONTACTS
from trunnion.elements.joints import JointKind
from trunnion.system.structure.bodies_and_joints import Body, Joint, Load, System

UNITS = {"angle": "rad", "length": "m", "quaternion": "1"}
"""Unit of each kind of coordinate."""
DEVICES = {
    "spring": "spring", "damping": "damper", "nonlinear": "nonlinear", "stop": "end_stop", "effort": "effort", "motor": "motor",
    "latch": "latch",
}  # fmt: skip
"""{field of a device of a freedom: word in column names}."""


@dataclass(frozen=True)
class Subject:
    """The object that a set of columns describes.

    key       unique among the subjects of one type in a system.
    words     texts by word, which fill the templates of names, units and descriptions.
    data      the body, joint, load or system.
    freedom   index of the joint's freedom, from 0."""

    key: tuple
    words: dict[str, str]
    data: Any
    freedom: int = 0


@dataclass(frozen=True)
class SubjectType:
    """A type of subjects.

    name         phrase for messages.
    scope        the items of a system that have such subjects ("bodies", "joints", "ties", "loads", "system").
    words        the words that every subject of this type has.
    found        function that yields the subjects of an item, from its index and the item.
    by_freedom   whether consecutive kinds with this flag are sorted by freedom (see ``registry.subjects``)."""

    name: str
    scope: str
    words: tuple[str, ...]
    found: Callable[[int, Any], Iterator[Subject]]
    by_freedom: bool = False


def items(system: System, scope: str) -> list[Any]:
    """The items of a scope, in order."""
    return [system] if scope == "system" else list(getattr(system, scope))


def _units(kind: JointKind, freedom: int) -> dict[str, str]:
    """Units of displacement and effort along a freedom: rad and N·m for a rotation, m and N for a translation."""
    return {"displacement": "rad", "effort": "N*m"} if kind.turns(freedom) else {"displacement": "m", "effort": "N"}


def _body(i: int, b: Body) -> Iterator[Subject]:
    yield Subject((i,), {"body": b.name}, b)


def _point(i: int, b: Body) -> Iterator[Subject]:
    yield from (Subject((i, name), {"body": b.name, "point": name}, b) for name, _ in b.points)


def _joint(_: int, j: Joint) -> Iterator[Subject]:
    yield Subject((j.name,), {"joint": j.name}, j)


def _gearbox_row(_: int, j: Joint) -> Iterator[Subject]:
    if j.mimic:
        yield Subject((j.rows,), {"joint": j.name}, j)


def _coordinates(_: int, j: Joint) -> Iterator[Subject]:
    for i, c in enumerate(j.kind.coordinates):
        yield Subject((j.name, i), {"joint": j.name, "number": str(i + 1), "displacement": UNITS[c]}, j)


def _freedom(j: Joint, k: int) -> Subject:
    return Subject((j.name, k), {"joint": j.name, "number": str(k + 1), **_units(j.kind, k)}, j, k)


def _freedoms(_: int, j: Joint) -> Iterator[Subject]:
    yield from (_freedom(j, k) for k in range(j.kind.nv))


def _driven(_: int, j: Joint) -> Iterator[Subject]:
    yield from (_freedom(j, k) for k in j.driven)


def _devices(_: int, j: Joint) -> Iterator[Subject]:
    for k, d in enumerate(j.devices):
        for field, word in DEVICES.items():
            if getattr(d, field) is not None:
                own = _freedom(j, k)
                stem = word if word == "effort" else f"{word}.effort"
                yield Subject((j.name, k, field), own.words | {"device": word, "what": word.replace("_", " "), "stem": stem}, j, k)


def _latches(_: int, j: Joint) -> Iterator[Subject]:
    yield from (_freedom(j, k) for k, d in enumerate(j.devices) if d.latch is not None)


def _tie(_: int, j: Joint) -> Iterator[Subject]:
    yield Subject((j.rows,), {"joint": j.name, "effort": "N" if j.travels else "N*m"}, j)


def _load(i: int, load: Load) -> Iterator[Subject]:
    yield Subject((i,), {"load": load.name}, load)


def _system(_: int, system: System) -> Iterator[Subject]:
    yield Subject((), {}, system)


def _friction_freedoms(_: int, j: Joint) -> Iterator[Subject]:
    """Freedoms along which friction acts. The column name of a rotation contains the rotation's number, from 1. The column name of
    a translation contains a number only if friction acts along several translations."""
    if not j.friction:
        return
    bound = CONTACTS[j.friction.contact].bound  # the outputs of the contacts include the friction along these freedoms
    travels = [k for k in range(j.kind.nv) if k not in bound and not j.kind.turns(k)]
    for k in range(j.kind.nv):
        if k in bound:
            continue
        turn = sum(map(j.kind.turns, set(range(k + 1)) - set(bound)))
        force = f"force[{travels.index(k) + 1}]" if len(travels) > 1 and k in travels else "force"
        words = {"what": "torque", "place": f"torque[{turn}]"} if j.kind.turns(k) else {"what": "force", "place": force}
        yield Subject((j.name, k), _freedom(j, k).words | words, j, k)


def _banded(_: int, j: Joint) -> Iterator[Subject]:
    if j.friction and CONTACTS[j.friction.contact].tensions:
        yield Subject((j.name, 0), {"joint": j.name}, j)


def _pairs(_: int, j: Joint) -> Iterator[Subject]:
    for n, s in enumerate(j.friction.sliders if j.friction else ()):
        yield Subject((s.flag,), {"joint": j.name, "number": str(n + 1)}, j)


def _bristles(_: int, j: Joint) -> Iterator[Subject]:
    for k in range(j.kind.nv) if j.friction and j.friction.bristles else ():
        radius = ", at the radius" if j.kind.turns(k) else ""
        yield Subject((j.name, k), _freedom(j, k).words | {"radius": radius}, j, k)


def _work(_: int, j: Joint) -> Iterator[Subject]:
    if j.friction:
        sense = "less what the bristles have stored" if j.friction.bristles else "≤ 0"
        yield Subject((f"friction:{j.name}",), {"joint": j.name, "sense": sense}, j)


def _only(found: Callable[[int, Any], Iterator[Subject]], holds: Callable[[Any], Any]) -> Callable[[int, Any], Iterator[Subject]]:
    """The function ``found``, without subjects of items for which ``holds`` is false."""
    return lambda number, item: found(number, item) if holds(item) else iter(())


FREEDOM_WORDS = ("joint", "number", "displacement", "effort")
BODY = SubjectType("a body", "bodies", ("body",), _body)
POINT = SubjectType("a named point", "bodies", ("body", "point"), _point)
JOINT = SubjectType("a joint", "joints", ("joint",), _joint)
ROD = SubjectType("a rod", "joints", ("joint",), _only(_joint, lambda j: j.kind.keeps_distance))
UNILATERAL = SubjectType("a joint that only pushes", "joints", ("joint",), _only(_joint, lambda j: j.unilateral))
GEARBOX = SubjectType("a gearbox", "joints", ("joint",), _only(_joint, lambda j: bool(j.mimic)))
GEARBOX_ROW = SubjectType("the row of a gearbox", "joints", ("joint",), _gearbox_row)
COORDINATES = SubjectType("a coordinate", "joints", ("joint", "number", "displacement"), _coordinates)
FREEDOM = SubjectType("a freedom", "joints", FREEDOM_WORDS, _freedoms)
DRIVEN = SubjectType("a driven freedom", "joints", FREEDOM_WORDS, _driven)
DEVICE = SubjectType("a device", "joints", (*FREEDOM_WORDS, "device", "what", "stem"), _devices, by_freedom=True)
LATCH = SubjectType("a latch", "joints", FREEDOM_WORDS, _latches, by_freedom=True)
FRICTION_FREEDOM = SubjectType("a freedom with friction", "joints", (*FREEDOM_WORDS, "what", "place"), _friction_freedoms)
BANDED = SubjectType("a band or belt", "joints", ("joint",), _banded)
PAIR = SubjectType("a friction pair", "joints", ("joint", "number"), _pairs)
BRISTLES = SubjectType("bristles", "joints", (*FREEDOM_WORDS, "radius"), _bristles)
FRICTION_WORK = SubjectType("a joint's friction", "joints", ("joint", "sense"), _work)
FRICTIONAL_JOINT = SubjectType("a joint with friction", "joints", ("joint",), _only(_joint, lambda j: j.friction))
TIE = SubjectType("a coupling", "ties", ("joint", "effort"), _tie)
SPRING = SubjectType("a spring between points", "loads", ("load",), _only(_load, lambda load: load.kind == "spring_damper"))
BUSHING = SubjectType("a bushing", "loads", ("load",), _only(_load, lambda load: load.kind == "bushing"))
SYSTEM = SubjectType("the system", "system", (), _system)
