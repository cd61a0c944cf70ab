"""``trunnion.sweep`` of example 8.1 with 10⁶ cases or fewer: time, memory during the sweep, and the ratio to the rate of a loop
that only steps.

Run it with ``python -m tests.benchmarks.speed.million_cases [CASES] [--workers N] [--until T] [--parts N]``. Friction and start
rate are sampled. Each case lasts 10 s, as in the model. The bare rate comes from as many threads as workers. Each thread only runs
``tr_batch_run`` over prepared cases from the whole sample. The bare rate is measured before and after the sweep (with ``--parts``,
each of N sweeps). Rates are given per second of wall time and per processor second; the latter do not depend on other work of the
machine. The memory is the memory of the process. """

from __future__ import annotations

import argparse
import ctypes
import statistics
import time
from concurrent.futures import ThreadPoolExecutor

import psutil

import trunnion
from trunnion.batch.plan_and_runner import Plan, Runner, plan
from trunnion.scene.overrides import scene_given
from trunnion.simulation.runtime_interface import simulation_block as bl
from trunnion.simulation.settings.run_settings import Run

SAMPLE = {"joints.ball.friction.mu": (0.1, 0.6), "joints.ball.start.qd[2]": (-1.0, 1.0)}
KEEP = ("max:ball.contact[1].normal_force", "final:pendulum.position[3]", "first:reversal", "count:reversal")
BARE = 600
"""Cases of a thread for one measurement of the bare rate."""


def bare(of: Plan, workers: int, turn: int) -> tuple[float, float]:
    """(cases per second of wall time, cases per second of processor time) of ``workers`` threads that only make steps."""
    prepared = []
    for w in range(workers):
        runner = Runner(of)
        start = ((turn * workers + w) * 7919 * BARE) % max(1, of.cases.count - BARE)
        (rows,), _ = runner.preparer.rows(of.cases.values(start, start + BARE))
        loop = runner._loop(rows)
        prepared.append((loop, rows, loop._begin(rows, None)))

    def steps(loop, rows, out) -> float:
        began = time.thread_time()
        while (status := loop.lib.tr_batch_run(ctypes.addressof(loop.batch), 1_000_000)) != bl.DONE:
            if status == bl.NEED_JACOBIAN:
                loop._jacobian()
        return time.thread_time() - began

    with ThreadPoolExecutor(workers) as pool:
        began = time.perf_counter()
        used = list(pool.map(lambda p: steps(*p), prepared))
    return workers * BARE / (time.perf_counter() - began), workers * BARE / sum(used)


class Marks:
    """Memory of the process at every tenth of a sweep."""

    def __init__(self, cases: int):
        self.every, self.seen = cases // 10, list[tuple[int, float]]()

    def __call__(self, done: int, cases: int) -> None:
        if done >= self.every * (1 + len(self.seen)):
            self.seen.append((done, psutil.Process().memory_info().rss / 1e6))


def swept(cases: int, asked: argparse.Namespace, seed: int) -> tuple[float, float]:
    """Cases (for each second by the clock, for each processor second) of one sweep. The function prints time and memory of the
    sweep."""
    marks = Marks(cases)
    at, cpu = time.perf_counter(), time.process_time()
    options = {"reductions": KEEP, "until": asked.until, "workers": asked.workers, "seed": seed, "progress": marks}
    s = trunnion.sweep("spherical_pendulum", sample=SAMPLE, count=cases, **options)
    wall, used = time.perf_counter() - at, time.process_time() - cpu
    along = ", ".join(f"{done}: {mb:.0f}" for done, mb in marks.seen)
    print(f"{cases} cases in {wall:.1f} s, {cases / wall:.0f} a second, {cases / used:.0f} a processor second; {s.counts}")
    print(f"  memory, MB, at cases: {along}; the table takes {s.table.nbytes / 1e6:.1f}", flush=True)
    return cases / wall, cases / used


def main() -> None:
    """Print the figures."""
    ask = argparse.ArgumentParser(description=__doc__)
    ask.add_argument("cases", type=int, nargs="?", default=1_000_000)
    ask.add_argument("--workers", type=int, default=2)
    ask.add_argument("--until", type=float, default=10.0)
    ask.add_argument("--parts", type=int, default=1)
    asked = ask.parse_args()
    whole = plan(scene_given("spherical_pendulum"), sample=SAMPLE, count=asked.cases, keep=KEEP, run=Run(until=asked.until))
    bare(whole, asked.workers, 0)
    loops, shares = [bare(whole, asked.workers, 0)], []
    for part in range(asked.parts):
        rate = swept(asked.cases // asked.parts, asked, part)
        loops.append(bare(whole, asked.workers, part + 1))
        near = [statistics.mean(x[k] for x in loops[-2:]) for k in (0, 1)]
        shares.append([r / n for r, n in zip(rate, near, strict=True)])
        print(f"  {asked.workers} bare loops: {near[0]:.0f} a second, {near[1]:.0f} a processor second", flush=True)
    clock, processor = (statistics.median(x[k] for x in shares) for k in (0, 1))
    print(f"of {asked.workers} bare loops: {clock:.3f} by the clock, {processor:.3f} by processor time")


if __name__ == "__main__":
    main()
