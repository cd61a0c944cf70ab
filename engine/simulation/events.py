"""Event records of the runtime as Event objects."""

from __future__ import annotations

import numpy as np

from engine.simulation.pairs import slider_names, stop_names
from engine.simulation.result import Event
from engine.system.structure import System

KINDS = {1: "reversal", 2: "stop", 3: "slip", 4: "separation", 5: "turn", 6: "stop_on", 7: "stop_off", 8: "switch", 9: "impact"}


def decode(system: System, records: np.ndarray) -> list[Event]:
    """Records (n×24) → events."""
    sliders, stops = slider_names(system), stop_names(system)
    out = []
    for r in records:
        kind, index, n = KINDS[int(r[1])], int(r[2]), int(r[3])
        name, part = (stops if kind.startswith("stop_") else sliders)[index]
        triple = r[4 : 4 + 3 * n].reshape(n, 3)
        out.append(Event(float(r[0]), kind, name, part, *(tuple(float(v) for v in triple[:, c]) for c in range(3))))
    return out
