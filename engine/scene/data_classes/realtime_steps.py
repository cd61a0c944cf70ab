"""Fixed steps for real time, as a scene gives them."""

from __future__ import annotations

from typing import Annotated

from pydantic.dataclasses import dataclass

from trunnion.basics.number_declarations import Bound
from trunnion.scene.data_classes.field_types import STRICT
from trunnion.scene.units.quantities import Duration, Per

EVENTS, EVALUATIONS, ITERATIONS = Bound(0.0, 1e3), Bound(1.0, 1e6), Bound(1.0, 1e6)
"""Counts a bounded step may be given."""


@dataclass(frozen=True, config=STRICT)
class RealTime:
    """Fixed steps for real time, with bounds of their work. A fallback finishes a step that exceeds a bound; the run reports it."""

    step: Duration
    """Length of the steps."""
    events: Annotated[float, Per("1", EVENTS)] = 2
    """Most events that are located in a step."""
    evaluations: Annotated[float, Per("1", EVALUATIONS)] = 42
    """Most evaluations of the equations of motion in a step; one without events takes eight."""
    iterations: Annotated[float, Per("1", ITERATIONS)] | None = None
    """Most iterations of Newton's method in a step; default: 46, and 8 for each frictional freedom."""
