"""The run whose results an FMU contains as its reference (FMI-LS-REF). Its stated errors also cover the runs of other machines."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from trunnion.scene.data_classes.scene import Scene
from trunnion.simulation.global_error.error_estimate import certainty
from trunnion.simulation.results.error_statement import Certainty
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate
from trunnion.system.construction.start_values_and_scales import Numbers

CHANGE = 1e-9
"""Relative change of rtol between the run and its repetitions. The change is small, so that a repetition differs from the run only
where a motion amplifies round-off."""
REPETITIONS = 8
"""Number of repetitions of a run that amplifies round-off. With SPREAD = 2, the runs of `cart_pole` at 22 tolerances exceed the
errors stated from any eight of them in 0.05 % of 4,000 cases."""
PROBE, SPREAD = 20.0, 2.0
"""Factors on the difference of a repetition from the run. PROBE: a run amplifies round-off if the difference times PROBE exceeds
the run's error. SPREAD: the stated errors are at least the differences times SPREAD. The safety factor of error estimates applies
in addition."""


def reference_run(scene: Scene, numbers: Numbers, settings: dict[str, Any]) -> Result:
    """A run with error estimates. The processor and the communication steps of another host change the round-off of a run. If the
    motion amplifies round-off, the run is repeated, and the differences of the repetitions enlarge its errors. numbers: scales of
    the scene. settings: arguments of ``trunnion.simulate``."""
    run = simulate(scene, certify=True, **settings)
    stated = run.certainty
    assert stated is not None
    for i in range(1, 1 + REPETITIONS):
        other = simulate(scene, **settings | {"rtol": (1.0 - i * CHANGE) * float(scene.simulation.rtol)})
        if i == 1 and not _larger(certainty(run, other, numbers, PROBE), stated):
            break
        stated = _both(stated, certainty(run, other, numbers, SPREAD))
    return replace(run, certainty=stated)


def _larger(one: Certainty, stated: Certainty) -> bool:
    """Whether an error of ``one`` exceeds the same error of ``stated``, or ``one`` is valid for a shorter time."""
    return one.promise.until < stated.promise.until or bool((one.error > stated.error).any())


def _both(a: Certainty, b: Certainty) -> Certainty:
    """The larger errors of two statements, up to the time at which both are valid."""
    promise = min(a.promise, b.promise, key=lambda p: p.until)
    return replace(a, error=np.maximum(a.error, b.error), shift=np.maximum(a.shift, b.shift), promise=promise)
