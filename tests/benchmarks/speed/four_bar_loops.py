"""Cost of a step of N loops: processor time of a step of the N-four-bar (A02), divided by N. The step has a fixed length, six
evaluations and their overhead. Hinges are ideal, or all have friction (``--rubs``)."""

from __future__ import annotations

import argparse
import time
from dataclasses import replace

import numpy as np

from tests.benchmarks.speed.processor_time import pin
from tests.scalable_mechanisms import n_four_bar
from trunnion.runtime.abi import Status
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface.simulation_block import Settings

STEP, STEPS, LEAST, TIMES = 2e-5, 1000, 5, 9
"""Step of the fifth-order method, s; number of measured steps for one loop, and smallest number for many loops; repetitions. Cranks
stay upright."""


def rubbing(scene: sm.Scene) -> sm.Scene:
    """The N-four-bar with friction in every hinge."""
    rub = sm.Friction(mu=0.1, radius=0.01, half_length=0.05)
    return replace(scene, joints={n: replace(j, friction=rub) for n, j in scene.joints.items()})


def step(scene: sm.Scene, kernel: str, steps: int) -> tuple[float, float]:
    """Least processor time of a step among several repetitions, and the processor time to build the model and make its first step,
    s."""
    began = time.process_time()
    model, settings = Model(scene, ("crank0.position*",), kernel), Settings(method="rk5", step=STEP)
    until, row = 1.0, np.zeros(4)
    model.block.configure(settings)
    model.block.assemble()
    model.begin(settings, 0.0, until, until, row)
    _advance(model, until, 1)
    made, best = time.process_time() - began, np.inf
    for _ in range(TIMES):
        began = time.process_time()
        before = model.block.statistics()["steps"]
        _advance(model, until, steps)
        best = min(best, (time.process_time() - began) / (model.block.statistics()["steps"] - before))
    return best, made


def _advance(model: Model, until: float, steps: int) -> None:
    """Make at least this many steps. Events are read whenever their buffer is full."""
    last = model.block.statistics()["steps"] + steps
    while model.block.statistics()["steps"] < last:
        status, _ = model.block.advance(until, steps, np.zeros((2, 4)))
        assert status in (Status.MORE, Status.EVENTS_FULL), status
        model.block.take_events()


def main() -> None:
    """Print a line for each size."""
    parser = argparse.ArgumentParser()
    parser.add_argument("sizes", type=int, nargs="*", default=[1, 4, 16, 64, 256])
    parser.add_argument("--kernel", default="parts")
    parser.add_argument("--rubs", action="store_true")
    given = parser.parse_args()
    pin()
    found: list[tuple[int, float]] = []
    for n in given.sizes:
        scene = n_four_bar(n)
        took, made = step(rubbing(scene) if given.rubs else scene, given.kernel, max(LEAST, STEPS // n))
        grows = f"exponent {np.log(took / found[-1][1]) / np.log(n / found[-1][0]):.2f}" if found else ""
        print(f"{n:4d} {took * 1e6:12.1f} µs a step   {made:6.2f} s to the first   {grows}", flush=True)
        found.append((n, took))
    if len(found) > 1:
        print(f"exponent over all {np.polyfit(*np.log(found).T, 1)[0]:.2f}")


if __name__ == "__main__":
    main()
