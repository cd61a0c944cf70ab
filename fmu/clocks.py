"""The clocks of an FMI 3.0 FMU: one for each joint and kind of event that can happen in it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from engine.abi import EventKind
from engine.friction import REGISTRY as LAWS
from engine.simulation.pairs import slider_names, stop_names
from engine.simulation.run import Model
from fmu.literals import integers

SLIDES = (
    EventKind.REVERSAL, EventKind.STOP, EventKind.SLIP, EventKind.SEPARATION, EventKind.TURN, EventKind.IMPACT, EventKind.FOLD,
)  # fmt: skip
STOPS, LATCHES = (EventKind.STOP_ON, EventKind.STOP_OFF), (EventKind.LATCH, EventKind.UNLATCH)
LAST, NAME = ("last", "element"), "events.last.joint_name"
"""Key of the column that gives the joint of the last event by its number, and the variable that gives its name."""


@dataclass(frozen=True)
class Clock:
    """A clock that ticks at events of one kind in one joint."""

    joint: str
    kind: EventKind

    @property
    def name(self) -> str:
        """Its name, from which those of what goes with it are made."""
        return f"{self.joint}.events.{self.kind.name.lower()}"

    @property
    def description(self) -> str:
        """What it ticks at, in words."""
        return f"{self.kind.name.lower().replace('_', ' ')} in joint {self.joint}: {self.kind.about}"


def clocks(model: Model) -> list[Clock]:
    """All clocks, in the order of their references."""
    return list(dict.fromkeys([*_of_pairs(model), *_of_stops(model)]))


def _of_pairs(model: Model) -> Iterator[Clock]:
    """Those of joints that rub. A law that is smooth has no event of its own, only contacts that separate."""
    for j in model.system.frictional:
        assert j.friction is not None
        law = LAWS[j.friction.law]
        for kind in SLIDES if law.bristles or law.sets or law.kinks else (EventKind.SEPARATION,):
            yield Clock(j.name, kind)


def _of_stops(model: Model) -> Iterator[Clock]:
    names = stop_names(model.system)
    for joint in dict.fromkeys(name for name, _ in names):
        for kind in STOPS:
            yield Clock(joint, kind)
    for joint in dict.fromkeys(name for name, _ in names[model.system.stops - model.system.latches :]):
        for kind in LATCHES:
            yield Clock(joint, kind)


def clock_table(model: Model, made: list[Clock]) -> str:
    """The C record that says which clock ticks at which event of which pair or stop."""
    place = {(c.joint, c.kind): i for i, c in enumerate(made)}
    kinds = max(EventKind) + 1
    watched = [name for name, _ in (*slider_names(model.system), *stop_names(model.system))]
    known = {int(k): k for k in EventKind}
    of = [place.get((name, known[k]), -1) if k in known else -1 for name in watched for k in range(kinds)]
    last = next((i for i, c in enumerate(model.columns) if c.key == LAST), -1)
    return integers("m_clock_of", of) + f"static const fmu_clocks m_clocks={{{len(made)},{kinds},{last},m_clock_of}};\n"
