"""The columns a scene can give: their names (NOTATION, "Columns"), units and where each comes from. No symbolic library here."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from engine.abi import EventKind, Overrun, Verdict
from engine.basics.numbers import ANY, NOT_NEGATIVE, Bound
from engine.basics.patterns import matcher
from engine.contact import REGISTRY as CONTACTS
from engine.joints import JointKind
from engine.kernel.quantities import Quantity, quantity
from engine.system.structure import Joint, System

QUATERNION = ("quaternion",)


@dataclass(frozen=True)
class Column:
    """A column: name, unit, description, and the key (kind, object, index…) by which the output unit builds its expression.
    post: "" or what the runtime does with it: "hold" (kept while its contact is open), "wrap" (angle continued by turns)."""

    name: str
    unit: str
    description: str
    key: tuple
    post: str = ""
    bound: Bound = ANY
    """What it cannot leave."""

    @property
    def quantity(self) -> Quantity:
        """What it is a quantity of."""
        return quantity(self.key)


def columns(system: System) -> list[Column]:
    """Every column of the system, in order."""
    out: list[Column] = []
    for i, b in enumerate(system.bodies):
        out += _body(i, b.name, [n for n, _ in b.points])
    for j in system.joints:
        out += _joint(j)
    for j in system.ties:
        what = "what makes the freedom of a joint follow another's, on its outboard part"
        out.append(Column(f"{j.name}.effort[1]", "N" if j.travels else "N*m", what, ("tie", j.rows)))
    return [*out, *_springs(system), *_whole(system)]


def select(all_columns: list[Column], patterns: tuple[str, ...]) -> list[Column]:
    """Columns whose name matches one of the patterns (shell style; "[k]" is an index, not a character class)."""
    wanted = matcher(patterns)
    return [c for c in all_columns if wanted(c.name)]


def _three(name: str, unit: str, description: str, key: tuple, n: int = 3) -> list[Column]:
    return [Column(f"{name}[{k + 1}]", unit, description, (*key, k)) for k in range(n)]


def _body(i: int, name: str, points: list[str]) -> Iterator[Column]:
    yield from _three(f"{name}.position", "m", f"mass centre of {name}, world frame", ("position", i))
    yield from _three(f"{name}.velocity", "m/s", f"velocity of the mass centre of {name}", ("velocity", i))
    yield from _three(f"{name}.acceleration", "m/s^2", f"acceleration of the mass centre of {name}", ("acceleration", i))
    yield from _three(f"{name}.orientation", "1", f"orientation of {name}, quaternion, scalar first", ("orientation", i), 4)
    yield from _three(f"{name}.angular_velocity", "rad/s", f"angular velocity of {name}, world frame", ("omega", i))
    for p in points:
        yield from _three(f"{name}.{p}.position", "m", f"point {p} of {name}, world frame", ("point", i, p))


def _unit(kind: JointKind, freedom: int) -> tuple[str, str]:
    """Units of displacement and of effort along a freedom of a joint: rad and N*m where it turns, m and N where it slides."""
    return ("rad", "N*m") if kind.turns(freedom) else ("m", "N")


def _joint(j: Joint) -> Iterator[Column]:
    """Columns of a joint: motion, reaction, efforts of its drives, and those of its friction."""
    kind, name = j.kind, j.name
    for i, c in enumerate(kind.coordinates):
        unit = {"angle": "rad", "length": "m", "quaternion": "1"}[c]
        post = "wrap" if j.cut and c == "angle" else ""
        yield Column(f"{name}.q[{i + 1}]", unit, f"coordinate {i + 1} of {name}", ("q", name, i), post)
    for k in range(kind.nv):
        u = _unit(kind, k)[0]
        yield Column(f"{name}.qd[{k + 1}]", f"{u}/s", f"rate {k + 1} of {name}", ("qd", name, k))
    for k in range(kind.nv):
        u = _unit(kind, k)[0]
        yield Column(f"{name}.qdd[{k + 1}]", f"{u}/s^2", f"acceleration {k + 1} of {name}", ("qdd", name, k))
    if kind.nv < 6:  # a joint that leaves all six freedoms transmits nothing
        what = "transmitted by {} to the inboard part, inboard joint frame"
        yield from _three(f"{name}.reaction.force", "N", "force " + what.format(name), ("reaction", name, "f"))
        yield from _three(f"{name}.reaction.torque", "N*m", "torque " + what.format(name), ("reaction", name, "m"))
    for k in j.driven:
        yield Column(f"{name}.drive.effort[{k + 1}]", _unit(kind, k)[1], f"effort of the drive of {name}", ("drive", name, k))
        yield Column(f"{name}.drive.power[{k + 1}]", "W", f"power of the drive of {name}", ("power", name, k, "drive"))
    yield from _devices(j)
    if j.friction:
        yield from _friction(j)


DEVICES = {"spring": "spring", "damping": "damper", "stop": "stop", "effort": "effort", "motor": "motor", "latch": "latch"}
"""Fields of a freedom's device, and what its columns are called."""


def _devices(j: Joint) -> Iterator[Column]:
    """Columns of what acts along a joint's freedoms: effort on the outboard part, and its power."""
    for k, d in enumerate(j.devices):
        for field, word in DEVICES.items():
            if getattr(d, field) is not None:
                text = f"of the {word} of {j.name}, on the outboard part along freedom {k + 1}"
                own = f"{j.name}.{word}" + (".effort" if word != "effort" else "")
                yield Column(f"{own}[{k + 1}]", _unit(j.kind, k)[1], f"force or torque {text}", ("device", j.name, k, field))
                yield Column(f"{j.name}.{word}.power[{k + 1}]", "W", f"power {text}", ("power", j.name, k, field))
        if d.latch is not None:
            text = f"the tooth that the latch of {j.name} is on, 0: up"
            yield Column(f"{j.name}.latch.state[{k + 1}]", "1", text, ("latched", j.name, k))


def _springs(system: System) -> Iterator[Column]:
    """Columns of springs between points and of bushings."""
    for i, load in enumerate(system.loads):
        if load.kind == "spring_damper":
            name = load.name
            yield Column(f"{name}.length", "m", f"length of {name}", ("line", i, "length"))
            yield Column(f"{name}.force", "N", f"force with which {name} pulls its ends together", ("line", i, "force"))
            yield Column(f"{name}.power", "W", f"power of {name} on the bodies", ("line", i, "power"))
        if load.kind == "bushing":
            yield from _bushing(i, load.name)


def _bushing(i: int, name: str) -> Iterator[Column]:
    """Columns of a bushing, in its axes on the first body."""
    for what, unit, text in (
        ("offset", "m", "offset of the second point in {}"), ("turn", "rad", "rotation vector of the second part in {}"),
        ("force", "N", "force of {} on the second part"), ("torque", "N*m", "torque of {} on the second part"),
    ):  # fmt: skip
        yield from _three(f"{name}.{what}", unit, f"{text.format(name)}, axes of the first", ("bushing", i, what))
    yield Column(f"{name}.power", "W", f"power of {name} on the bodies", ("bushing", i, "power", 0))


def _friction(j: Joint) -> Iterator[Column]:
    """Columns of a joint with friction: friction along its freedoms, state of each pair, work, and its contacts."""
    name, kind = j.name, j.kind
    assert j.friction is not None
    turn = 0
    element = CONTACTS[j.friction.contact]
    for k in range(kind.nv):
        if k in element.bound:
            continue  # no friction: it is in the contacts' forces
        if kind.turns(k):
            turn += 1
            text = f"friction torque of {name} on the inboard part"
            yield Column(f"{name}.friction.torque[{turn}]", "N*m", text, ("friction", name, k))
        else:
            yield Column(f"{name}.friction.force", "N", f"friction force of {name} on the inboard part", ("friction", name, k))
    for n, s in enumerate(j.friction.sliders):
        text = "sliding state: −1, +1 slipping, 0 proportional zone or stick (always 0 where a law has no such states)"
        yield Column(f"{name}.friction.state[{n + 1}]", "1", text, ("state", s.flag))
    if j.friction.bristles:
        for k in range(kind.nv):
            turns = kind.turns(k)
            text = f"deflection of the bristles of {name} along freedom {k + 1}" + (", at the radius" if turns else "")
            yield Column(f"{name}.friction.bristle[{k + 1}]", "m", text, ("bristle", name, k))
    sense = "less what the bristles have stored" if j.friction.bristles else "≤ 0"
    yield Column(f"{name}.friction.work", "J", f"work of friction in {name} ({sense})", ("quad", f"friction:{name}"))
    for i in range(element.count):
        c = f"{name}.contact[{i + 1}]"
        text = f"normal force at contact {i + 1} of {name}"
        yield Column(f"{c}.normal_force", "N", text, ("contact", name, i, "force"), bound=NOT_NEGATIVE)
        yield Column(f"{c}.angle", "rad", f"orientation angle of contact {i + 1} of {name}", ("contact", name, i, "angle"), "hold")
        if element.elevates:
            key = ("contact", name, i, "elevation")
            yield Column(f"{c}.elevation", "rad", f"elevation of contact {i + 1} of {name}", key, "hold")
        yield from _three(f"{c}.normal", "1", "outward normal of the pin, inboard joint frame", ("contact", name, i, "normal"))
        yield Column(f"{c}.state", "1", "1: touching, 0: no contact force", ("contact", name, i, "state"))


def _whole(system: System) -> Iterator[Column]:
    yield Column("energy.kinetic", "J", "kinetic energy", ("kinetic",))
    yield Column("energy.potential", "J", "potential energy of gravity and springs", ("potential",))
    yield Column("energy.dissipated", "J", "energy lost to friction and dampers", ("dissipated",))
    yield Column("energy.residual", "J", "energy now − at the start − work of drives and loads + dissipated", ("residual",))
    yield Column("audit.constraint", "1", "largest loop closure residual (lengths per length scale, rad)", ("extra", "closure"))
    yield Column("audit.complement", "1", "relative residual of the complement equations", ("extra", "complement"))
    text = "contraction of fixed-point iteration of the complement equations"
    yield Column("audit.contraction", "1", text, ("extra", "contraction"))
    text = f"what the audit says so far: {', '.join(f'{v.value} {v.name.lower()}' for v in Verdict)}"
    yield Column("audit.verdict", "1", text, ("extra", "verdict"), bound=NOT_NEGATIVE)
    yield Column("events.count", "1", "events so far", ("extra", "events"), bound=NOT_NEGATIVE)
    if system.bounded:
        text = f"how the last bounded step was made: {', '.join(f'{o.value} {o.name.lower()}' for o in Overrun)}".replace("_", " ")
        yield Column("realtime.overrun", "1", text, ("extra", "overrun"), bound=NOT_NEGATIVE)
        text = "bounded steps so far whose rest was made by a fallback"
        yield Column("realtime.overruns", "1", text, ("extra", "overruns"), bound=NOT_NEGATIVE)
    for name, field, unit, text in LAST:
        yield Column(f"events.last.{name}", unit, text, ("last", field))


LAST = (
    ("time", "time", "s", "time of the last event (0: none yet)"),
    ("kind", "kind", "1", f"last event: {', '.join(f'{e.value} {e.name.lower()}' for e in EventKind)}".replace("_", " ")),
    ("joint", "element", "1", "its joint: the k-th joint with friction, in the order of the columns (0: none)"),
    ("contact", "contact", "1", "its contact that turned most, from 1 (0: none)"),
    ("angle_before", "before", "rad", "that contact's angle before"),
    ("angle_after", "after", "rad", "that contact's angle after"),
    ("turn", "turn", "rad", "by how much its normal turned"),
    ("marginal", "marginal", "1", "1: it is decided by less than the run's own error"),
)
"""Columns ``events.last.*``: name, field of ``tr_last``, unit, description."""


def needs_quadratures(chosen: list[Column]) -> bool:
    """Whether any chosen column is an integral."""
    return any(c.quantity.integral for c in chosen)
