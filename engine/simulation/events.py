"""Event records of the runtime as Event objects."""

from __future__ import annotations

import numpy as np

from engine.simulation.result import Event
from engine.system.structure import System

KINDS = {1: "reversal", 2: "stop", 3: "slip", 4: "separation", 5: "turn", 6: "stop_on", 7: "stop_off", 8: "switch"}


def slider_names(system: System) -> list[tuple[str, int]]:
    """(joint, part from 1) of every sliding pair, by flag."""
    out: list[tuple[str, int]] = []
    for j in system.frictional:
        assert j.friction is not None
        out += [(j.name, i + 1) for i, _ in enumerate(j.friction.sliders)]
    return out


def stop_names(system: System) -> list[tuple[str, int]]:
    """(joint, freedom from 1) of every stop, by flag."""
    found: dict[int, tuple[str, int]] = {}
    for j in system.joints:
        for k, d in enumerate(j.devices):
            if d.stop is not None:
                found |= {f: (j.name, k + 1) for f in d.stop.flags if f >= 0}
    return [found[i] for i in sorted(found)]


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
