"""Processor time of ``sensitivity``, compared with one run of ``simulate``. Derivatives are with respect to one number and to ten
numbers (or all numbers of a smaller scene). The script also measures a fit. Calls alternate; parts and libraries are compiled
before the first call."""

from __future__ import annotations

import csv
import statistics
import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

import trunnion
from tests.benchmarks.speed.processor_time import pin
from trunnion.analysis.fits.parameter_estimation import fit
from trunnion.analysis.sensitivities.initial_data_derivatives import parameter_problems
from trunnion.analysis.sensitivities.sensitivity import sensitivity
from trunnion.scene.library.model_folders import model_folder
from trunnion.scene.overrides import list_parameters, scene_given

CASES = (
    ("friction_identification", "joints.pivot.friction.mu", "pivot.q[1]", 6.0),
    ("spherical_pendulum", "joints.ball.friction.mu", "ball.qd[2]", 10.0),
    ("crank_slider", "joints.slider_pin.friction.mu", "slider_pin.friction.torque[1]", 2.0),
    ("double_pendulum", "joints.cross.friction.mu", "lower.position[1]", 5.0),
)
"""Scene, number, column and end of each run."""
MOST = 10
KINDS = (".friction.", ".density", ".damping", "gravity", ".spring", ".start.")


def many(scene: str) -> list[str]:
    """Up to ten numbers of a scene. Runs of the scene have derivatives with respect to these numbers."""
    loaded = scene_given(scene)
    found = [p.path for p in list_parameters(loaded) if p.value and any(k in p.path for k in KINDS)]
    return [p for p in found if not parameter_problems(loaded, [p])][:MOST]


def taken(call: Callable[[], Any]) -> float:
    """Processor time of a call, ms."""
    began = time.process_time()
    call()
    return (time.process_time() - began) * 1e3


def measured() -> tuple[np.ndarray, np.ndarray]:
    """Times and angles of the measured swing."""
    with (model_folder("friction_identification") / "measured.csv").open() as f:
        rows = np.array(list(csv.reader(f))[1:], float)
    return rows[:, 0], rows[:, 1]


def main(rounds: int) -> None:
    """Print minimum and median of each call."""
    pin()
    for scene, number, column, until in CASES:
        names = many(scene)

        def run(scene: str = scene, column: str = column, until: float = until) -> object:
            return trunnion.simulate(scene, until=until, outputs=[column], rtol=1e-6)

        def by(names: list[str], scene: str = scene, column: str = column, until: float = until) -> object:
            return sensitivity(scene, names, [column], until, rtol=1e-6)

        calls: dict[str, Callable[[], object]] = {"run": run, "by 1": partial(by, [number]), f"by {len(names)}": partial(by, names)}
        for call in calls.values():
            call()
        times: dict[str, list[float]] = {what: [] for what in calls}
        for _ in range(rounds):
            for what, call in calls.items():
                times[what].append(taken(call))
        least = min(times["run"])
        print(f"{scene:24s}", flush=True)
        for what, t in times.items():
            print(f"  {what:6s} {min(t):.1f} ({statistics.median(t):.1f}) ms = {min(t) / least:.1f} runs", flush=True)
    at, angle = measured()
    number, curves = ["joints.pivot.friction.mu"], {"pivot.q[1]": angle}
    spent = [taken(lambda: fit("friction_identification", number, at, curves)) for _ in range(rounds)]
    print(f"fit of one number to {len(at)} samples: {min(spent):.0f} ({statistics.median(spent):.0f}) ms")


if __name__ == "__main__":
    main(int(sys.argv[1]) if sys.argv[1:] else 7)
