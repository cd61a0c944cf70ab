"""Event records of the runtime as Event objects."""

from __future__ import annotations

import numpy as np

from engine.abi import EventKind
from engine.simulation.event import Event
from engine.simulation.pairs import slider_names, stop_names
from engine.system.structure import System


def decode(system: System, records: np.ndarray) -> list[Event]:
    """The runtime's event records (n ``tr_event``) as events with the names of joints."""
    sliders, stops = slider_names(system), stop_names(system)
    out = []
    for r in records:
        kind, index, turned = EventKind(int(r["kind"])).name.lower(), int(r["index"]), r["turned"][: int(r["contacts"])]
        name, part = (stops if kind.startswith("stop_") else sliders)[index]
        angles = (tuple(float(v) for v in turned[which]) for which in ("before", "after", "turn"))
        out.append(Event(float(r["time"]), kind, name, part, *angles))
    return out
