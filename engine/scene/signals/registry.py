"""All kinds of signals. A new kind needs a new file and a line in KINDS, which is in the order of the keys."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from trunnion.basics.objects_by_import_path import objects
from trunnion.scene.signals.declaration import Corner, SignalKind


def registered(kinds: Iterable[type[SignalKind]]) -> dict[str, SignalKind]:
    """The kinds by key. Raises ValueError if two kinds have the same key or label."""
    out: dict[str, SignalKind] = {}
    labels: set[str] = set()
    for kind in kinds:
        if kind.key in out or labels.intersection(kind.labels):
            raise ValueError(f"two kinds of signals are called {kind.key}")
        labels.update(kind.labels)
        out[kind.key] = kind()
    return out


KINDS = (
    "constant.ConstantKind",
    "ramp.RampKind",
    "move.MoveKind",
    "harmonic.HarmonicKind",
    "table.TableKind",
    "step.StepKind",
    "pulse.PulseKind",
    "trapezoid.TrapezoidKind",
    "expression.ExpressionKind",
)
REGISTRY: dict[str, SignalKind] = registered(objects(__package__, KINDS))
OF_LABEL = {label: kind for kind in REGISTRY.values() for label in kind.labels} | {"expression": REGISTRY["expression"]}
"""The kind of each label (``SignalKind.labels``)."""
LOADS = tuple(key for key, kind in REGISTRY.items() if not kind.loads)
"""Keys of the signals of loads."""
DRIVES = tuple(key for key, kind in REGISTRY.items() if kind.drives is None)
"""Keys of the signals of drives."""


def all_given(s: Any) -> list[tuple[SignalKind, Any]]:
    """(kind, value of its key) for each kind that a signal or drive gives. A valid signal has one kind."""
    return [(kind, data) for key, kind in REGISTRY.items() if (data := getattr(s, key, None)) is not None]


def given(s: Any) -> tuple[SignalKind, Any]:
    """The kind and the keys of a valid signal, or of a valid drive that does not follow an input."""
    return all_given(s)[0]


def corners(s: Any) -> Iterator[Corner]:
    """The times at which a step must end because of a signal or drive."""
    if getattr(s, "input", None) is not None:
        return
    kind, data = given(s)
    yield from kind.corners(data)
    limit = getattr(s, "limit", None)
    for level in limit.levels if limit is not None else ():
        yield from kind.crossings(data, level)


def value_at(s: Any, t: float) -> float:
    """Value of a load's signal at t, s."""
    kind, data = given(s)
    value = kind.value(data, t)
    return value if s.limit is None else float(s.limit.of(value))
