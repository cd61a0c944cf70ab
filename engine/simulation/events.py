"""Event records of the runtime as Event objects."""

from __future__ import annotations

import numpy as np

from engine.abi import EventKind
from engine.simulation.event import Event
from engine.simulation.pairs import slider_names, stop_names
from engine.system.structure import System

KINDS = {k.value: k.name.lower() for k in EventKind}
STOP_KINDS = {k.name.lower() for k in (EventKind.STOP_ON, EventKind.STOP_OFF, EventKind.LATCH, EventKind.UNLATCH)}
"""Events of stops and latches; all others are of sliding pairs."""


def decode(system: System, records: np.ndarray) -> list[Event]:
    """The runtime's event records (n ``tr_event``) as events with the names of joints. Fields are read one after the other for
    all records: record by record, NumPy takes longer over an event than the runtime does to find it."""
    if not len(records):
        return []
    sliders, stops, turned = slider_names(system), stop_names(system), records["turned"]
    fields = [records[f].tolist() for f in ("time", "kind", "index", "contacts", "margin", "marginal")]
    angles = [turned[f].tolist() for f in ("before", "after", "turn")]
    out = []
    for time, number, index, contacts, margin, marginal, *each in zip(*fields, *angles, strict=True):
        kind, n = KINDS[int(number)], int(contacts)
        name, part = (stops if kind in STOP_KINDS else sliders)[int(index)]
        before, after, turn = (tuple(a[:n]) for a in each)
        out.append(Event(time, kind, name, part, before, after, turn, margin, bool(marginal)))
    return out
