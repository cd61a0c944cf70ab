"""Fixed steps for real time, as a scene gives them."""

from __future__ import annotations

from typing import Annotated

from trunnion.basics.lazy_data_classes import validated
from trunnion.basics.number_declarations import Bound
from trunnion.scene.data_classes.field_types import STRICT
from trunnion.scene.units.numbers_with_units import Duration, Per

EVENTS, EVALUATIONS, ITERATIONS = Bound(0.0, 1e3), Bound(1.0, 1e6), Bound(1.0, 1e6)
"""Allowed values of the bounds on the work in a step."""


@validated(frozen=True, config=STRICT)
class RealTime:
    """Fixed steps for real time, with bounds on their work. If a step would exceed a bound, a fallback finishes the step, and the
    run reports the fallback."""

    step: Duration
    """Length of the steps."""
    events: Annotated[float, Per("1", EVENTS)] = 2
    """Largest number of events that are located in a step."""
    evaluations: Annotated[float, Per("1", EVALUATIONS)] = 42
    """Largest number of evaluations of the equations of motion in a step; a step without events needs eight."""
    iterations: Annotated[float, Per("1", ITERATIONS)] | None = None
    """Largest number of Newton iterations in a step; default: 46, plus 8 for each frictional freedom."""
