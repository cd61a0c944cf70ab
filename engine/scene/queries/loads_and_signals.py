"""Iteration over the loads and signals of a scene, and over the entries of joint devices by freedom."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from trunnion.elements.contact import sizes
from trunnion.elements.friction import numbers as law_numbers
from trunnion.scene.data_classes.scene import Drive, Force, Scene, Signal, Torque
from trunnion.scene.findings.findings_and_paths import Path

VARYING = tuple(n.name for group in (law_numbers(), sizes()) for n, _ in group.values() if n.varies)
"""Names of the friction numbers that may depend on time or an input."""


def entries(value: Any, path: Path) -> Iterator[tuple[Path, Any]]:
    """(path, entry) for each entry that is not None; ``value`` is a list with one entry per freedom, or a single entry."""
    if isinstance(value, tuple):
        yield from ((((*path, i)), v) for i, v in enumerate(value) if v is not None)
    elif value is not None:
        yield path, value


def each(value: Any, count: int) -> list[Any]:
    """A list of ``count`` entries, one per freedom. A single entry belongs to the first freedom; all other freedoms then have the
    entry None."""
    return list(value) if isinstance(value, tuple) else [value, *[None] * (count - 1)][:count]


def loads(scene: Scene) -> Iterator[tuple[Path, Any]]:
    """(path, load) of all joint efforts, signals of motors and latches, friction numbers that may vary, and components of applied
    forces and torques."""
    for name, j in scene.joints.items():
        yield from entries(j.effort, ("joints", name, "effort"))
        for path, motor in entries(j.motor, ("joints", name, "motor")):
            yield (*path, "signal"), motor.signal
        for path, latch in entries(j.latch, ("joints", name, "latch")):
            yield (*path, "release"), latch.release
        for n in VARYING if j.friction is not None else ():
            yield from entries(getattr(j.friction, n), ("joints", name, "friction", n))
    for name, f in scene.forces.items():
        if isinstance(f, Force | Torque):
            yield from entries(f.force if isinstance(f, Force) else f.torque, ("forces", name, f.type))


def signals(scene: Scene) -> Iterator[tuple[Path, Drive | Signal]]:
    """(path, signal) of every function of time."""
    for name, j in scene.joints.items():
        yield from entries(j.drive, ("joints", name, "drive"))
    yield from ((path, load) for path, load in loads(scene) if isinstance(load, Signal))
