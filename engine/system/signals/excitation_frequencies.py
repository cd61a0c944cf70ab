"""How fast what acts on a mechanism comes and goes: its frequencies, by which the runtime bounds its steps while friction holds.

A stuck pair does not move until its load exceeds friction. Error control therefore misses a load that comes and goes within a
step.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from trunnion.system.structure.bodies_and_joints import Signal, System
from trunnion.system.structure.parameter_table import Leaf, Param


def frequencies(system: System) -> tuple[tuple[int, float], ...]:
    """(run-time parameter, Hz per unit of it) of every harmonic signal and of every rate at which a freedom is made to turn."""
    found: dict[int, float] = {}
    for signal, turns in _signals(system):
        for leaf, unit in _paces(signal, turns):
            if isinstance(leaf, Param):
                found[leaf.index] = unit
    return tuple(sorted(found.items()))


def _signals(system: System) -> Iterator[tuple[Signal, bool]]:
    """All signals, and whether they are the angle of a driven freedom."""
    for joint in system.joints:
        for rate, device in enumerate(joint.devices):
            if device.effort is not None:
                yield device.effort, False
            if device.drive is not None:
                yield device.drive, joint.kind.axes[rate][0].rot
    for load in system.loads:
        yield from ((s, False) for s in load.vector if s is not None)


def _paces(signal: Signal, turns: bool) -> Iterator[tuple[Leaf, float]]:
    """The frequencies among the numbers of a signal, in Hz per unit."""
    if signal.kind == "harmonic":
        yield signal.leaves[1], 1.0
    elif turns and signal.kind == "rate":
        yield signal.leaves[1], 1.0 / (2.0 * math.pi)
    elif turns and signal.kind in ("ramp", "begun"):
        yield from ((leaf, 1.0 / (2.0 * math.pi)) for leaf in signal.leaves[:2])
