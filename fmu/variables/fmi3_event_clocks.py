"""Clocks of an FMI 3.0 FMU: one for each joint and kind of event."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.fmu.c_text.literals import integers
from trunnion.runtime.abi import EventKind
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface.friction_pair_and_stop_names import slider_names, stop_names

SLIDES = (
    EventKind.REVERSAL, EventKind.STICK, EventKind.SLIP, EventKind.SEPARATION, EventKind.CONTACT_JUMP, EventKind.IMPACT,
    EventKind.FOLD,
)  # fmt: skip
CONTACTS = (EventKind.CONTACT_OPENED, EventKind.CONTACT_CLOSED, EventKind.CONTACT_RESTS)
END_STOPS, LATCHES = (EventKind.END_STOP_ENGAGED, EventKind.END_STOP_RELEASED), (EventKind.LATCH, EventKind.UNLATCH)
LAST, NAME = ("last", "element"), "events.last.joint_name"
"""LAST: key of the output column with the number of the joint of the last event. NAME: the variable with the name of this joint."""


@dataclass(frozen=True)
class Clock:
    """A clock that ticks at events of one kind in one joint."""

    joint: str
    kind: EventKind

    @property
    def name(self) -> str:
        return f"{self.joint}.events.{self.kind.name.lower()}"

    @property
    def description(self) -> str:
        return f"{self.kind.name.lower().replace('_', ' ')} in joint {self.joint}: {self.kind.about}"


def clocks(model: Model) -> list[Clock]:
    """All clocks in order of their value references."""
    return list(dict.fromkeys([*_of_pairs(model), *_of_stops(model)]))


def _of_pairs(model: Model) -> Iterator[Clock]:
    """The clocks of joints with friction. With a smooth friction law, the separation of a contact is the only kind of event."""
    for j in model.system.frictional:
        assert j.friction is not None
        law = LAWS[j.friction.law]
        for kind in SLIDES if law.bristles or law.sets or law.kinks else (EventKind.SEPARATION,):
            yield Clock(j.name, kind)


def _of_stops(model: Model) -> Iterator[Clock]:
    names, pushing = stop_names(model.system), [j.name for j in model.system.unilateral]
    for joint in dict.fromkeys(name for name, _ in names if name not in pushing or _has_stops(model, name)):
        for kind in END_STOPS:
            yield Clock(joint, kind)
    for joint in dict.fromkeys(name for name, _ in names[model.system.stops - model.system.latches :]):
        for kind in LATCHES:
            yield Clock(joint, kind)
    for joint in pushing:
        for kind in CONTACTS:
            yield Clock(joint, kind)


def _has_stops(model: Model, name: str) -> bool:
    """Whether a joint whose contact can separate has end stops, too."""
    return any(d.stop for j in model.system.joints if j.name == name for d in j.devices)


def clock_table(model: Model, made: list[Clock]) -> str:
    """The C record that maps each event of a friction pair or end stop to its clock."""
    place = {(c.joint, c.kind): i for i, c in enumerate(made)}
    kinds = max(EventKind) + 1
    watched = [name for name, _ in (*slider_names(model.system), *stop_names(model.system))]
    known = {int(k): k for k in EventKind}
    of = [place.get((name, known[k]), -1) if k in known else -1 for name in watched for k in range(kinds)]
    last = next((i for i, c in enumerate(model.columns) if c.key == LAST), -1)
    return integers("m_clock_of", of) + f"static const fmu_clocks m_clocks={{{len(made)},{kinds},{last},m_clock_of}};\n"
