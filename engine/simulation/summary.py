"""The summary of a result: its main columns with their ranges, its last values, its events in words."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from engine.joints import REGISTRY
from engine.simulation.event import Event

if TYPE_CHECKING:
    from engine.simulation.result import Result

NEGLIGIBLE = 1e-9
"""A component this much smaller than the largest of its kind in the same joint is not a main column."""
MAIN = ("friction.torque[*]", "friction.force", "contact[*].normal_force", "friction.work")
WHOLE = ("energy.residual", "audit.constraint")


@dataclass(frozen=True)
class Range:
    """Smallest, largest and last value of a column."""

    name: str
    unit: str
    low: float
    high: float
    last: float


def main_columns(result: Result, most: int = 16) -> list[str]:
    """Names of the columns one looks at first: friction and contact forces of every frictional joint, coordinates, energy
    balance."""
    joints = result.scene.joints
    names: list[str] = []
    for name in (n for n, j in joints.items() if j.friction is not None):
        for pattern in MAIN:
            names += _large(result, result.matching(f"{name}.{pattern}"))
    for name, j in joints.items():
        if REGISTRY[j.type].quaternion < 0:
            names += result.matching(f"{name}.q[*]")
    kept = list(dict.fromkeys(names))[: most - len(WHOLE)]
    return [*kept, *(n for n in WHOLE if n in result)] or result.names[1 : most + 1]


def _large(result: Result, names: list[str]) -> list[str]:
    sizes = [float(np.nanmax(np.abs(result[n]), initial=0.0)) for n in names]
    top = max(sizes, default=0.0)
    return [n for n, s in zip(names, sizes, strict=True) if s > NEGLIGIBLE * top] or names[:1]


def started(result: Result) -> bool:
    """Whether the rows hold a motion (a run that failed at its start has none)."""
    return len(result) > 0 and (result.outcome.ok or result.stats.steps > 0)


def ranges(result: Result, names: list[str] | None = None) -> list[Range]:
    """Ranges of columns (default: the main ones); empty when the run did not start."""
    if not started(result):
        return []
    out = []
    for name in main_columns(result) if names is None else names:
        values = result[name]
        finite = values[np.isfinite(values)]
        low, high = (float(finite.min()), float(finite.max())) if len(finite) else (math.nan, math.nan)
        out.append(Range(name, result.units[name], low, high, float(values[-1])))
    return out


def final_values(result: Result) -> dict[str, float]:
    """Every column's last value."""
    return dict(zip(result.names, map(float, result.data[-1]), strict=True)) if started(result) else {}


def counted(events: tuple[Event, ...]) -> dict[str, int]:
    """How many events of each kind."""
    out: dict[str, int] = {}
    for e in events:
        out[e.kind] = out.get(e.kind, 0) + 1
    return out


def marginal_note(events: tuple[Event, ...]) -> str:
    """What there is to say of events that are decided by less than the run's own error; empty: nothing."""
    marked = [e for e in events if e.marginal]
    if not marked:
        return ""
    first, instants = marked[0], len({e.time for e in marked})
    many = f"{instants} events are" if instants > 1 else "an event is"
    where = f"{'the first ' if instants > 1 else ''}at t = {first.time:.6g} s: {first.kind.replace('_', ' ')} of {first.joint}"
    return f"{many} marginal ({where}): decided by less than the run's own error; a tighter tolerance (rtol) tells more"


def document(result: Result) -> dict[str, Any]:
    """The result without its rows, as plain data: outcome, statistics, settings, final values, events, notes."""
    return {
        "scene": result.scene.name,
        "outcome": asdict(result.outcome) | {"ok": result.outcome.ok},
        "settings": dict(result.settings),
        "stats": asdict(result.stats),
        "rows": len(result),
        "final": final_values(result),
        "units": result.units,
        "events": [asdict(e) for e in result.events],
        "notes": list(result.notes),
        "audit": result.audit.document(),
        **({"certainty": result.certainty.document()} if result.certainty is not None else {}),
    }
