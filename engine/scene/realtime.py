"""What a scene says about steps for real time."""

from __future__ import annotations

from typing import Annotated

from pydantic.dataclasses import dataclass

from engine.basics.numbers import Bound
from engine.scene.quantities import Duration, Per
from engine.scene.values import STRICT

EVENTS, EVALUATIONS, ITERATIONS = Bound(0.0, 1e3), Bound(1.0, 1e6), Bound(1.0, 1e6)
"""Counts a bounded step may be given."""


@dataclass(frozen=True, config=STRICT)
class RealTime:
    """Steps for real time: fixed ones with bounds of their work. What is over a bound is finished by a fallback, and told."""

    step: Duration
    """Length of the steps."""
    events: Annotated[float, Per("1", EVENTS)] = 2
    """Most events that are located in a step."""
    evaluations: Annotated[float, Per("1", EVALUATIONS)] = 42
    """Most evaluations of the equations of motion in a step; one without events takes eight."""
    iterations: Annotated[float, Per("1", ITERATIONS)] | None = None
    """Most iterations of Newton's method in a step; left out, 46 and 8 for each freedom that rubs."""
