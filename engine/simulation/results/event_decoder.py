"""Conversion of the runtime's event records to Event objects."""

from __future__ import annotations

import numpy as np

from trunnion.runtime.abi import EventKind
from trunnion.simulation.results.event import Event
from trunnion.simulation.runtime_interface.friction_pair_and_stop_names import slider_names, stop_names
from trunnion.system.structure.bodies_and_joints import System

KINDS = {k.value: k.name.lower() for k in EventKind}
CONTACTS = (EventKind.CONTACT_OPENED, EventKind.CONTACT_CLOSED, EventKind.CONTACT_RESTS)
DEVICES = (EventKind.END_STOP_ENGAGED, EventKind.END_STOP_RELEASED, EventKind.LATCH, EventKind.UNLATCH, *CONTACTS)
DEVICE_KINDS = {k.name.lower() for k in DEVICES}
"""Kinds of events of end stops, latches and joints that only push. All other kinds are events of friction pairs."""


def decode(system: System, records: np.ndarray) -> list[Event]:
    """Events with the names of joints, from the runtime's event records (n ``tr_event``).

    The loop reads a plain list for each field, because access to single NumPy records takes longer than the runtime needs to locate
    an event."""
    if not len(records):
        return []
    sliders, stops, turned = slider_names(system), stop_names(system), records["turned"]
    fields = [records[f].tolist() for f in ("time", "kind", "index", "contacts", "margin", "marginal")]
    angles = [turned[f].tolist() for f in ("before", "after", "turn")]
    out = []
    for time, number, index, contacts, margin, marginal, *each in zip(*fields, *angles, strict=True):
        kind, n = KINDS[int(number)], int(contacts)
        name, part = (stops if kind in DEVICE_KINDS else sliders)[int(index)]
        before, after, turn = (tuple(a[:n]) for a in each)
        out.append(Event(time, kind, name, part, before, after, turn, margin, bool(marginal)))
    return out
