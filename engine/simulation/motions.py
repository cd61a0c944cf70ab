"""What drives prescribe at an instant, by the same expressions and curves as a run; statics uses it, and what users are told."""

from __future__ import annotations

import numpy as np

from engine.joints import REGISTRY
from engine.parts.signals import motion
from engine.scene.contexts import slides
from engine.simulation.block import signals
from engine.system.build import Built
from engine.system.curves import Curve, table_block
from engine.system.external import INSIDE
from engine.system.structure import Signal

AFTER = 1e-12
"""How long after an instant, s, the branch of a signal there is chosen; the runtime does the same where a run starts."""
STILL = 1e-9
"""Rate of a curve, in units of its steepest rise between two of its times, that counts as rest (round-off is 1e-16)."""


def driven(built: Built) -> list[tuple[str, int, Signal]]:
    """(joint, number of the freedom from 0, drive) of every driven freedom."""
    return [(j.name, k, d.drive) for j in built.system.joints for k, d in enumerate(j.devices) if d.drive is not None]


def positions(built: Built, t: float = 0.0) -> dict[tuple[str, int], float]:
    """Coordinate of every driven freedom at t, rad or m, by joint and number of the freedom (from 0)."""
    drives, p, x = driven(built), np.array(built.parameters.values, float), external(built, t)
    return {(name, k): float(motion(drive, built.system.external, p, x)[0]) for name, k, drive in drives}


def external(built: Built, t: float) -> np.ndarray:
    """External values x at time t: its time and signals are set, its flags and modes are zero."""
    x = np.zeros(built.system.external.size)
    x[INSIDE] = t + AFTER
    signals(table_block(built.numbers.tables), built.system.tables, t, x)
    return x


def beginning_notes(built: Built, against_data: bool) -> list[str]:
    """A line for every drive whose table begins with a rate. against_data: only where its first two values are equal."""
    tables = [(name, k, d.index) for name, k, d in driven(built) if d.kind == "table"]
    x, notes = external(built, 0.0) if tables else np.zeros(0), []
    for name, k, index in tables:
        curve, rate = built.numbers.tables[index], x[built.system.external.table(index) + 1]
        if not isinstance(curve, Curve) or abs(rate) <= STILL * np.abs(np.diff(curve.value) / np.diff(curve.time)).max():
            continue
        flat = curve.value[0] == curve.value[1] and curve.time[1] > 0.0
        if flat or not against_data:
            unit = "m/s" if slides(REGISTRY[built.scene.joints[name].type], k) else "rad/s"
            but = " although its first two values are equal" if flat else ""
            notes.append(f"{name}: its drive's table begins with {rate:.4g} {unit}{but}; interpolation: clamped begins at rest")
    return notes
