"""Bounded steps of 1 ms over examples 8.1, 8.2 and 8.3. When all joints are at rest, or after 20 s, a new case begins with random
start and friction.

Run it with ``python -m tests.benchmarks.speed.realtime_steps [STEPS]`` (10,000,000 steps, and a tenth of this number with the
default bounds; about five minutes). For each example the script prints operations and time of a step (median, 99.9th percentile,
maximum). It prints the ratio of maximum to median beside the static bound. The script also prints the number of steps beyond each
bound, the events, and the unexplained energy."""

from __future__ import annotations

import ctypes
import math
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from trunnion.runtime.abi.run_records import STATS
from trunnion.scene.overrides import scene_given
from trunnion.simulation.execution.runnable_model import Model
from trunnion.simulation.runtime_interface.simulation_block import OK, Settings
from trunnion.simulation.settings.realtime_steps import bounds_of, method_of, most_operations, work_of
from trunnion.system.construction.system_builder import build

STEP, LONGEST, LOOK = 1e-3, 20.0, 100
"""Step, s; longest case, s; number of steps after which the script checks whether all joints are at rest."""
SEED = 20261124
OVERRUNS = ("by_impulses", "relaxed")
COUNTED = ("rhs_evaluations", "maps", "newton_iterations", "solutions", *OVERRUNS, "events")
Draw = Callable[[np.random.Generator], dict[str, Any]]


def _pendulum(rng: np.random.Generator) -> dict[str, Any]:
    start = {"q": {"axis": list(rng.normal(size=3)), "angle": rng.uniform(-3.0, 3.0)}, "qd": list(rng.uniform(-3.0, 3.0, 3))}
    return {"joints.ball.start": start, "joints.ball.friction.mu": rng.uniform(0.05, 1.0)}


def _crank(rng: np.random.Generator) -> dict[str, Any]:
    mu = rng.uniform(0.05, 1.0)
    return {"joints.crank_pivot.drive.constant.rate": rng.uniform(20.0, 60.0), "joints.slider_pin.friction.mu": mu}


def _double(rng: np.random.Generator) -> dict[str, Any]:
    out: dict[str, Any] = {f"joints.{j}.friction.mu": rng.uniform(0.05, 0.3) for j in ("guide", "cross")}
    out["joints.guide.start"] = {"q": [0.0, rng.uniform(-3.0, 3.0)], "qd": list(rng.uniform(-8.0, 8.0, 2))}
    out["joints.cross.start"] = {"q": list(rng.uniform(-1.0, 1.0, 2)), "qd": list(rng.uniform(-8.0, 8.0, 2))}
    return out


SCENES: dict[str, tuple[Draw, float, dict[str, int]]] = {
    "spherical_pendulum": (_pendulum, 0.1, {"evaluations": 22, "iterations": 36}),
    "crank_slider": (_crank, 0.5, {"evaluations": 42, "iterations": 54}),
    "double_pendulum": (_double, 0.4, {"evaluations": 20, "iterations": 38}),
}
"""For each example: the function that draws a case; its share of the steps, which is largest where events are many; bounds with
which no step takes more than four times the middle one."""


@dataclass
class Taken:
    """Costs of steps: operations and seconds a step; counts of overruns and events; energies of cases, J; cases that ended."""

    operations: np.ndarray
    seconds: np.ndarray
    counts: dict[str, int]
    lost: list[float] = field(default_factory=list)
    turned: list[float] = field(default_factory=list)
    ended: dict[int, int] = field(default_factory=dict)
    cases: int = 0
    bound: int = 0
    made: int = 0


def bounded(name: str, **more: Any) -> dict[str, Any]:
    """A function that bounds the steps of an example."""
    return {"simulation.realtime": {"step": STEP, **more}}


class Driver:
    """An example whose cases are run step by step."""

    def __init__(self, name: str, draw: Draw, rng: np.random.Generator, **more: Any):
        self.name, self.draw, self.rng, self.over = name, draw, rng, bounded(name, **more)
        self.model = Model(scene_given(name, self.over), ("*",), "compiled")
        scene = self.model.built.scene
        self.settings = Settings(float(scene.simulation.rtol), method_of(scene, scene.simulation.method), **bounds_of(scene))
        names = [c.name for c in self.model.columns]
        self.columns = [1 + names.index(f"energy.{n}") for n in ("residual", "dissipated", "kinetic")]
        self.row = np.zeros(self.model.block.width)

    def begin(self) -> bool:
        """Begin a new case; returns whether it starts."""
        built = build(scene_given(self.name, self.over | self.draw(self.rng)))
        block = self.model.block
        block.take(built.numbers, np.array(built.parameters.values))
        block.configure(self.settings)
        started = block.assemble() == 1 and self.model.begin(self.settings, 0.0, math.inf, math.inf, self.row) == OK
        block = self.model.block
        self.counts = (ctypes.c_long * (ctypes.sizeof(STATS.ctype) // 8)).from_address(block.lib.tr_statistics(block.at))
        self.kinetic = self.row[self.columns[2]]
        return started

    def case(self, taken: Taken, steps: int) -> None:
        """Add at most this many steps of one case to ``taken``."""
        block, places = self.model.block, [STATS.names.index(n) for n in COUNTED]
        work, sizes = work_of(self.model.kernel), self.model.kernel.sizes
        assert work is not None
        at, go, row, counts = block.at, block.lib.tr_reach_bounded, self.row.ctypes.data, self.counts
        rates = block.y[sizes["nq"] : sizes["nq"] + sizes["nv"]]
        before = [counts[i] for i in places]
        for k in range(1, min(steps, round(LONGEST / STEP)) + 1):
            began = time.perf_counter_ns()
            code = go(at, k * STEP, row)
            taken.seconds[taken.made] = 1e-9 * (time.perf_counter_ns() - began)
            now = [counts[i] for i in places]
            d = [a - b for a, b in zip(now, before, strict=True)]
            taken.operations[taken.made] = work.of(d[0] + d[1], d[2] + d[3], d[5])
            taken.made, before = taken.made + 1, now
            if code != 5:
                taken.ended[code] = taken.ended.get(code, 0) + 1
                break
            if k % LOOK == 0 and len(rates) and max(abs(rates)) < 1e-9:
                break
        for n, i in zip(COUNTED, places, strict=True):
            taken.counts[n] += counts[i]
        lost, dissipated, _ = (float(self.row[i]) for i in self.columns)
        taken.lost.append(lost), taken.turned.append(abs(dissipated) + self.kinetic)
        taken.cases += 1


def run(name: str, steps: int, seed: int = SEED, **more: Any) -> Taken:
    """Make this many bounded steps of an example. more: bounds."""
    driver = Driver(name, SCENES[name][0], np.random.default_rng(seed), **more)
    bound = most_operations(driver.model.built.scene, driver.model.kernel) or 0
    taken = Taken(np.zeros(steps), np.zeros(steps), dict.fromkeys(COUNTED, 0), bound=bound)
    while taken.made < steps:
        if driver.begin():
            driver.case(taken, steps - taken.made)
    return taken


def told(name: str, t: Taken) -> str:
    """The lines of an example."""
    middle, high, largest = (np.percentile(t.operations, p) for p in (50, 99.9, 100))
    us = 1e6 * np.percentile(t.seconds, (50, 99.9, 100))
    lost, ratio = np.array(t.lost), largest / middle
    share = np.abs(lost) / np.maximum(t.turned, 1e-12)
    over = ", ".join(f"{t.counts[n]} {n}" for n in OVERRUNS)
    return "\n".join([
        f"{name}: {t.made:,} steps, {t.cases} cases, {t.counts['events']:,} events; ended {t.ended or 'none'}",
        f"  operations {middle:,.0f} · {high:,.0f} · {largest:,.0f}; largest / p50 {ratio:.2f}; static bound {t.bound:,}",
        f"  microseconds {us[0]:.1f} · {us[1]:.1f} · {us[2]:.1f}; over their bounds: {over} "
        f"({sum(t.counts[n] for n in OVERRUNS) / t.made:.1e} of the steps)",
        f"  energy unaccounted for: {np.abs(lost).sum():.3g} J of {sum(t.turned):.3g} J; worst case {share.max():.1e} of its own",
    ])


def main() -> None:
    """Run all examples and print their lines."""
    steps = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000_000
    for part in (1.0, 0.1):
        events = 0
        print("bounds of at most four times the middle step" if part == 1.0 else "bounds as they are by default")
        for name, (_, share, bounds) in SCENES.items():
            t = run(name, round(part * share * steps), **(bounds if part == 1.0 else {}))
            events += t.counts["events"]
            print(told(name, t), flush=True)
        print(f"events in all: {events:,}", flush=True)


if __name__ == "__main__":
    main()
