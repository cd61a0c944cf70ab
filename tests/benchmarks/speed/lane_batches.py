"""Cases per processor second of one core: several cases stepped together in SIMD lanes (``kernel="lanes"``), and one after the
other (``compiled``).

Run it with ``python -m tests.benchmarks.speed.lane_batches [--pairs N] [--only TEXT]``. The scenes are example 8.1, 8.2 undriven
without friction (swept in two ways), and an arm of six revolutes. Chunks of ``CASES`` alternate between both kernels, so that
changes in the machine's speed affect both. Figures: processor time of whole chunks (numbers, steps, outcomes, tables), minimum and
median over the pairs; processor time of the C loop alone; median of the ratios of the pairs."""

from __future__ import annotations

import argparse
import statistics
import time
from typing import Any

from tests.benchmarks.speed.processor_time import pin
from trunnion.batch.plan_and_runner import Runner, plan
from trunnion.scene.overrides import scene_given
from trunnion.simulation.settings.run_settings import Run

CASES = 400
ARM: tuple[tuple[str, float, float], ...] = (
    ("z", 0.4, 0.18), ("y", 0.45, 0.14), ("y", 0.40, 0.12), ("x", 0.15, 0.10), ("y", 0.15, 0.08), ("x", 0.10, 0.08)
)  # fmt: skip
"""Axis of each joint, length along x and thickness of the link it carries, m."""


def arm() -> dict[str, Any]:
    """Six revolutes in a row, with slight damping, released from a bent position."""
    bodies, joints, last = {}, {}, "ground"
    for i, (axis, length, side) in enumerate(ARM, 1):
        box = {"box": [length, side, side], "density": 2700, "center": [length / 2, 0, 0], "points": {"end": [length, 0, 0]}}
        bodies[f"link{i}"] = box
        start = {"q": 0.3 if axis == "y" else 0.1, "qd": 0.5}
        joints[f"joint{i}"] = {
            "type": "revolute",
            "axis": axis,
            "inboard": last,
            "outboard": f"link{i}",
            "damping": 0.01,
            "start": start,
        }
        last = f"link{i}.end"
    return {"schema": 1, "name": "arm", "gravity": [0, 0, -9.81], "bodies": bodies, "joints": joints}


ASKED: dict[str, tuple[Any, dict[str, Any], tuple[str, ...], Run]] = {
    "8.1": (
        "spherical_pendulum",
        {"joints.ball.friction.mu": (0.1, 0.6), "joints.ball.start.qd[2]": (-1.0, 1.0)},
        ("max:ball.contact[1].normal_force", "final:pendulum.position[3]"),
        Run(),
    ),
    "8.2 undriven": (
        "crank_slider_free",
        {"joints.crank_pivot.start.qd": (5.0, 15.0), "gravity[2]": (-9.9, -9.7)},
        ("max:crank.angular_velocity[3]", "final:slider.position[1]"),
        Run(),
    ),
    "8.2, densities": (
        "crank_slider_free",
        {"bodies.crank.density": (7000.0, 8500.0)},
        ("max:crank.angular_velocity[3]", "final:slider.position[1]"),
        Run(),
    ),
    "arm": (
        arm(),
        {"joints.joint2.start.q": (0.1, 0.5), "joints.joint1.start.qd": (-1.0, 1.0)},
        ("max:joint2.qd[1]", "final:link6.position[*]"),
        Run(until=2.0, every=0.01),
    ),
}  # fmt: skip


def runner(which: str, kernel: str, count: int) -> Runner:
    """A function that makes the cases of a scene with a kernel."""
    given, ranges, keep, run = ASKED[which]
    asked = Run(until=run.until, every=run.every, kernel=kernel)
    return Runner(plan(scene_given(given), sample=ranges, count=count, keep=keep, run=asked))


def timed(r: Runner, at: int) -> tuple[float, float]:
    """(processor seconds of a whole chunk, seconds of it in the C loop)."""
    before, began = r.seconds, time.process_time()
    r.chunk(at, at + CASES)
    return time.process_time() - began, r.seconds - before


def main() -> None:
    """Print the figures."""
    ask = argparse.ArgumentParser(description=__doc__)
    ask.add_argument("--pairs", type=int, default=9)
    ask.add_argument("--only", default="")
    asked = ask.parse_args()
    pin()
    print(f"{'scene':16s} {'kernel':9s} {'cases/s':>8s} {'median':>8s} {'bare':>8s}   ratio, whole and bare")
    for which in ASKED:
        if asked.only not in which:
            continue
        both = {k: runner(which, k, CASES * (asked.pairs + 1)) for k in ("compiled", "lanes")}
        for r in both.values():
            timed(r, 0)
        took = [{k: timed(r, CASES * (1 + i)) for k, r in both.items()} for i in range(asked.pairs)]
        for k in both:
            cpu, bare = ([t[k][j] for t in took] for j in (0, 1))
            said = ""
            if k == "lanes":
                ratios = [statistics.median(t["compiled"][j] / t["lanes"][j] for t in took) for j in (0, 1)]
                said = f"   {ratios[0]:.2f} {ratios[1]:.2f}"
            rates = f"{CASES / min(cpu):8.0f} {CASES / statistics.median(cpu):8.0f} {CASES / min(bare):8.0f}"
            print(f"{which:16s} {k:9s} {rates}{said}", flush=True)


if __name__ == "__main__":
    main()
