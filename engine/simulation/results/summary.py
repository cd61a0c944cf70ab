"""The summary of a result: main columns with their ranges, last values, events."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.joints import REGISTRY
from trunnion.runtime.integrators import AUTO
from trunnion.simulation.results.event import Event

if TYPE_CHECKING:
    from trunnion.simulation.results.result_data import ResultData, Stats

NEGLIGIBLE = 1e-9
"""A column is a main column only if its largest value is above this share of the largest value among the joint's columns of the
same kind."""
STIFF_STEPS = 100
"""Smallest number of steps limited by stability that a note reports. Fewer such steps cost little."""
MAIN = ("friction.torque[*]", "friction.force", "friction.force[*]", "contact[*].normal_force", "friction.work")
WHOLE = ("energy.residual", "audit.constraint")


@dataclass(frozen=True)
class Range:
    """Smallest, largest and last value of a column."""

    name: str
    unit: str
    low: float
    high: float
    last: float


def main_columns(result: ResultData, most: int = 16) -> list[str]:
    """Names of the main columns: friction and contact forces of every joint with friction, coordinates, energy balance."""
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


def _large(result: ResultData, names: list[str]) -> list[str]:
    sizes = [float(np.nanmax(np.abs(result[n]), initial=0.0)) for n in names]
    top = max(sizes, default=0.0)
    return [n for n, s in zip(names, sizes, strict=True) if s > NEGLIGIBLE * top] or names[:1]


def has_motion(result: ResultData) -> bool:
    """Whether the result contains a motion. A run that failed at its start has no motion."""
    return len(result) > 0 and (result.outcome.ok or result.stats.steps > 0)


def column_ranges(result: ResultData, names: list[str] | None = None) -> list[Range]:
    """Ranges of columns (default: the main columns); empty if the result contains no motion."""
    if not has_motion(result):
        return []
    out = []
    for name in main_columns(result) if names is None else names:
        values = result[name]
        finite = values[np.isfinite(values)]
        low, high = (float(finite.min()), float(finite.max())) if len(finite) else (math.nan, math.nan)
        out.append(Range(name, result.units[name], low, high, float(values[-1])))
    return out


def final_values(result: ResultData) -> dict[str, float]:
    """{column: last value}; empty if the result contains no motion."""
    return dict(zip(result.names, map(float, result.data[-1]), strict=True)) if has_motion(result) else {}


def count_events(events: tuple[Event, ...]) -> dict[str, int]:
    """Number of events of each kind."""
    return dict(Counter(e.kind for e in events))


def marginal_note(events: tuple[Event, ...]) -> str:
    """A note about events whose margin is below the run's own error; "" if there are none."""
    marked = [e for e in events if e.marginal]
    if not marked:
        return ""
    first, instants = marked[0], len({e.time for e in marked})
    many = f"{instants} events are" if instants > 1 else "an event is"
    where = f"{'the first ' if instants > 1 else ''}at t = {first.time:.6g} s: {first.kind.replace('_', ' ')} of {first.joint}"
    return f"{many} marginal ({where}): the event was decided by a margin smaller than the run's own error; use a tighter rtol"


def impact_note(counters: dict[str, int]) -> str:
    """A note about impacts whose friction follows from the rates after them; "" if there are none."""
    if not counters["stopped_at_once"]:
        return ""
    return (
        "in an impact, friction against the sliding has no solution: the sliding stops at once, and the rates after the impact "
        "decide friction"
    )


def stiffness_note(method: str, stats: Stats) -> str:
    """A note about a run in which stability limited most steps of an explicit method; "" for any other run."""
    stiff = stats.counters["stiff"]
    if stiff < STIFF_STEPS or 2 * stiff < stats.steps:
        return ""
    return (
        f"the motion is stiff: stability, not the tolerance, limited {stiff} of {stats.steps} steps; method {AUTO.stiff.name} or "
        f"auto takes longer steps than {method}"
    )


def document(result: ResultData) -> dict[str, Any]:
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
