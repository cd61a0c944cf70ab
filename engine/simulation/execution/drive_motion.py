"""Positions that drives prescribe at an instant, by the same expressions and curves as in a run; notes about tables of drives."""

from __future__ import annotations

import numpy as np

from trunnion.elements.joints import REGISTRY
from trunnion.parts.layout.signal_evaluation import motion
from trunnion.runtime.abi.header_constants import number
from trunnion.scene.queries.numbers_by_path import slides
from trunnion.simulation.runtime_interface.simulation_block import signals
from trunnion.system.construction.system_builder import Built
from trunnion.system.signals.signal_tables import SignalCurve, table_block
from trunnion.system.structure.bodies_and_joints import Signal
from trunnion.system.structure.external_value_layout import INSIDE

AFTER = number("JUST_AFTER")
"""Short time, s. A signal evaluated this long after an instant follows the branch that begins at the instant."""
STILL = 1e-9
"""Rate of a curve, relative to its largest slope between two points, that counts as zero (round-off is 1e-16)."""


def driven(built: Built) -> list[tuple[str, int, Signal]]:
    """For every driven freedom: (joint, index of the freedom from 0, drive)."""
    return [(j.name, k, d.drive) for j in built.system.joints for k, d in enumerate(j.devices) if d.drive is not None]


def positions(built: Built, t: float = 0.0) -> dict[tuple[str, int], float]:
    """{(joint, index of the freedom from 0): coordinate at t, rad or m} for every driven freedom."""
    drives, p, x = driven(built), np.array(built.parameters.values, float), external(built, t)
    return {(name, k): float(motion(drive, built.system.external, p, x)[0]) for name, k, drive in drives}


def external(built: Built, t: float) -> np.ndarray:
    """External values x (nx) at time t, s. Only time and signals are set; flags and modes are zero."""
    x = np.zeros(built.system.external.size)
    x[INSIDE] = t + AFTER
    signals(table_block(built.numbers.tables), built.system.tables, t, x)
    return x


def beginning_notes(built: Built, against_data: bool) -> list[str]:
    """A note for every drive whose table begins with a nonzero rate. against_data: whether to report only tables whose first two
    values are equal."""
    tables = [(name, k, d.index) for name, k, d in driven(built) if d.kind == "table"]
    x, notes = external(built, 0.0) if tables else np.zeros(0), []
    for name, k, index in tables:
        curve, rate = built.numbers.tables[index], x[built.system.external.table(index) + 1]
        if not isinstance(curve, SignalCurve) or abs(rate) <= STILL * np.abs(np.diff(curve.value) / np.diff(curve.time)).max():
            continue
        flat = curve.value[0] == curve.value[1] and curve.time[1] > 0.0
        if flat or not against_data:
            unit = "m/s" if slides(REGISTRY[built.scene.joints[name].type], k) else "rad/s"
            but = " although its first two values are equal" if flat else ""
            notes.append(
                f"{name}: the drive's table starts at {rate:.4g} {unit}{but}; set interpolation: clamped for a start at rest"
            )
    return notes
