"""``engine.sweep``: many cases of a scene on this machine's cores, into one table."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from engine.basics.extras import brought
from engine.basics.interrupts import Held, Unwanted, held, watched
from engine.batch.gathered import Gathered
from engine.batch.plan import Plan, Runner, Stopped, plan
from engine.batch.swept import Sweep, trajectory
from engine.scene.given import Amount, Names, names_given
from engine.scene.overrides import Given, scene_given
from engine.simulation.settings import Run, described, settings_read

if TYPE_CHECKING:
    pass

CHUNK_SECONDS = 0.25
FIRST_CHUNK, LARGEST_CHUNK = 16, 20_000
LOOK_SECONDS = 0.1
"""How often the main thread looks for Ctrl-C while the others work."""
SweepProgress = Callable[[int, int], None]
"""progress(cases done, cases), a few times a second."""


@described("engine.sweep")
def sweep(
    scene: Given,
    over: Mapping[str, Any] | None = None,
    cases: Sequence[Mapping[str, Any]] | None = None,
    sample: Mapping[str, Any] | None = None,
    *,
    count: int = 0,
    seed: int = 0,
    sampling: str = "latin",
    reductions: Names = (),
    trajectories: Names = (),
    spacing: float | None = None,
    certify: bool = False,
    overrides: Mapping[str, Any] | None = None,
    until: Amount | None = None,
    every: Amount | None = None,
    rtol: Amount | None = None,
    method: str | None = None,
    kernel: str | None = None,
    patience: Amount | None = None,
    steps: Amount | None = None,
    workers: int | None = None,
    progress: SweepProgress | None = None,
) -> Sweep:
    """Run a scene over many values of its numbers.

    scene: as for ``simulate``. Exactly one of over: {"joints.ball.friction.mu": "0.1:0.6:26", …} (every combination; lists too),
    cases: [{path: value, …}, …], and sample: {path: (low, high), or "normal(mean, deviation)", lognormal, "triangular(low, mode,
    high)"} with count, seed and sampling ("latin", "random", "sobol", or "saltelli", which ``indices`` needs). reductions:
    "max:PATTERN", min, mean, final of columns, "first:EVENT", "count:EVENT", and "error:…" of any of these, its global error;
    certify: the errors of all (each case is run twice). overrides: fixed changes. trajectories: columns (patterns) whose rows are
    kept of every case, spacing: how far apart, s (default: all). Reductions are over the rows that
    ``simulate`` would give with the same settings. workers: threads (default: one a core). A case that fails is a row with its
    outcome. Raises SceneError for wrong input. Ctrl-C gives the cases that are finished by then, with ``stopped`` set;
    KeyboardInterrupt when there is none yet.
    """
    loaded = scene_given(scene, overrides)
    asked = {"until": until, "every": every, "rtol": rtol, "method": method, "kernel": kernel}
    asked |= {"patience": patience, "steps": steps}
    values, wrong = settings_read("engine.sweep", asked)
    run, keep = Run(**values), names_given(reductions)
    rows: dict[str, Any] = {"trajectories": names_given(trajectories), "spacing": spacing, "certify": certify}
    ways: dict[str, Any] = {"count": count, "seed": seed, "sampling": sampling}
    chosen = plan(loaded, over, cases, sample, **ways, keep=keep, run=run, wrong=wrong, **rows)
    return run_plan(chosen, workers, progress)


def run_plan(of: Plan, workers: int | None = None, progress: SweepProgress | None = None) -> Sweep:
    """Run a whole plan on threads (the loop holds no lock of the interpreter while it steps). KeyboardInterrupt when it is
    stopped before any case is finished."""
    brought("pyarrow", "tables", "a table of cases")
    started = time.perf_counter()
    threads = max(1, min(workers or os.cpu_count() or 1, of.cases.count))
    work = _Work(of, progress)
    with held() as interrupt, ThreadPoolExecutor(threads) as pool:
        try:
            _await([pool.submit(work.take) for _ in range(threads)], work, interrupt)
        except KeyboardInterrupt:
            work.interrupted = True
        finally:
            work.stopped = True
    if work.interrupted and not work.done:
        raise KeyboardInterrupt
    return work.result(time.perf_counter() - started)


def _await(waiting: list[Future[None]], work: _Work, interrupt: Held) -> None:
    """Wait for the threads. After Ctrl-C, wait for the cases they are finishing; an error that stops a thread after that does
    not count."""
    left: set[Future[None]] = set(waiting)
    while left:
        done, left = wait(left, LOOK_SECONDS, FIRST_EXCEPTION)
        if interrupt.asked:
            raise KeyboardInterrupt
        for w in done:
            w.result()


class _Work:
    """The work of a sweep: chunks handed out in order, each sized from what the last ones cost, and their tables, kept by first
    case."""

    def __init__(self, of: Plan, progress: SweepProgress | None):
        self.plan, self.progress = of, progress
        self.lock = threading.Lock()
        self.next = self.done = 0
        self.tables, self.rows = Gathered(), Gathered()
        self.runners: list[Runner] = []
        self.stopped = self.interrupted = False
        self.told = time.perf_counter()

    def take(self) -> None:
        """Run chunks, in one thread, until none is left, or none is wanted."""
        with watched(self._look), suppress(Unwanted):  # raised between chunks, which keep what they have finished
            self._take()

    def _take(self) -> None:
        runner, size = Runner(self.plan), FIRST_CHUNK
        with self.lock:
            self.runners.append(runner)
        while not self.stopped:
            with self.lock:
                start, stop = self.next, min(self.next + size, self.plan.cases.count)
                self.next = stop
            if start == stop:
                return
            before, began = runner.seconds, time.perf_counter()
            try:
                got = runner.chunk(start, stop, self.go_on)
            except Stopped as s:
                got = s.table
            spent = max(runner.seconds - before, 0.5 * (time.perf_counter() - began - runner.build_seconds), 1e-6)
            size = int(min(max(1, (stop - start) * CHUNK_SECONDS / spent, 1), 4 * size, LARGEST_CHUNK))
            self._finished(start, got, runner.rows)

    def go_on(self, done: int) -> bool:
        """Whether to go on; the loop asks every few hundredths of a second and tells how many cases of its chunk are done."""
        return not self.stopped

    def _look(self) -> None:
        if self.stopped:
            raise Unwanted

    def _finished(self, start: int, got: Any, rows: Any) -> None:
        with self.lock:
            self.tables.add(start, got)
            if rows is not None:
                self.rows.add(start, rows)
            self.done += got.num_rows
            if self.progress and (time.perf_counter() - self.told > 0.1 or self.done == self.plan.cases.count):
                self.told = time.perf_counter()
                self.progress(self.done, self.plan.cases.count)

    def result(self, wall: float) -> Sweep:
        """The sweep, with all tables put together; when it was interrupted, the table's metadata say how many of the cases it
        has."""
        import pyarrow.compute as pc

        table = self.tables.whole()
        stopped = table.num_rows < self.plan.cases.count
        if stopped:
            told = {"stopped": f"{table.num_rows} of {self.plan.cases.count} cases finished"}
            table = table.replace_schema_metadata((table.schema.metadata or {}) | told)
        counts = {c["values"]: c["counts"] for c in pc.value_counts(table["outcome"]).to_pylist()}
        seconds = sum(r.seconds for r in self.runners)
        build = max((r.build_seconds for r in self.runners), default=0.0)
        kept = self.rows.whole() if self.plan.series is not None else None
        return Sweep(self.plan, table, wall, seconds, build, counts, stopped, kept)


__all__ = ["Sweep", "run_plan", "sweep", "trajectory"]
