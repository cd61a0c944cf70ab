"""Frequencies of the excitation of a mechanism. While a friction pair sticks, the runtime limits its steps by these frequencies.

A sticking pair does not move until its load exceeds friction. A load may exceed friction for less than one step; error control
does not notice such a load."""

from __future__ import annotations

from collections.abc import Iterator

from trunnion.scene.signals.registry import OF_LABEL
from trunnion.system.structure.bodies_and_joints import Signal, System
from trunnion.system.structure.parameter_table import Leaf, Param


def frequencies(system: System) -> tuple[tuple[int, float], ...]:
    """For the frequency of every harmonic signal and for every prescribed rotation rate: index of the run-time parameter, and
    factor to Hz."""
    found: dict[int, float] = {}
    for signal, turns in _signals(system):
        for leaf, unit in _paces(signal, turns):
            if isinstance(leaf, Param):
                found[leaf.index] = unit
    return tuple(sorted(found.items()))


def _signals(system: System) -> Iterator[tuple[Signal, bool]]:
    """All signals of devices, friction and loads, each with a flag: whether the signal prescribes a rotation."""
    for joint in system.joints:
        if joint.friction is not None:
            yield from ((x, False) for _, x in joint.friction.numbers if isinstance(x, Signal))
        for rate, device in enumerate(joint.devices):
            motor, latch = device.motor, device.latch
            own = (device.effort, motor.signal if motor else None, latch.release if latch else None)
            yield from ((s, False) for s in own if s is not None)
            if device.drive is not None:
                yield device.drive, joint.kind.axes[rate][0].rot
    for load in system.loads:
        yield from ((s, False) for s in load.vector if s is not None)


def _paces(signal: Signal, turns: bool) -> Iterator[tuple[Leaf, float]]:
    """(leaf, factor to Hz) for each parameter of a signal that is a frequency or a rotation rate."""
    if signal.of is not None:
        yield from _paces(signal.of, turns)
    elif signal.kind in OF_LABEL:
        yield from OF_LABEL[signal.kind].paces(signal, turns)
