"""Functions that replace mechanisms in tests of samples."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
import pyarrow as pa

import trunnion
from trunnion.batch.cases.grids_and_samples import Cases
from trunnion.batch.tables.reductions import Reduction

MU, RADIUS, G = "joints.ball.friction.mu", "joints.ball.friction.radius", "gravity[3]"
THREE = (MU, RADIUS, G)
GUIDE = {"joints.guide.friction.mu": (0.0995, 0.1005), "joints.guide.friction.half_length": (0.12, 0.2),
         "joints.guide.friction.radius": (0.02, 0.09)}  # fmt: skip
TRAVEL = "final:guide.q[1]"
OF = Reduction("final", "x", "m", "a result")
SEEDS = 120


@lru_cache(maxsize=1)
def scene() -> Any:
    return trunnion.load_scene("spherical_pendulum")


Of = Callable[[np.ndarray], np.ndarray]


def table(cases: Cases, f: Of, failing: Of | None = None) -> pa.Table:
    """The result of a batch whose cases have results computed by functions of their numbers."""
    x = cases.values(0, cases.count)
    failed = np.zeros(len(x), bool) if failing is None else failing(x)
    outcome = np.where(failed, "jammed", "done").tolist()
    return pa.table({"case": np.arange(len(x)), "outcome": outcome, OF.name: np.where(failed, 1e9, f(x))})
