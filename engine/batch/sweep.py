"""``sweep``: runs many cases of a scene on this machine's cores."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait
from contextlib import suppress
from typing import Any

from trunnion.basics.interrupts import DeferredInterrupt, Unwanted, held, watched
from trunnion.basics.optional_packages import brought
from trunnion.batch.plan_and_runner import Plan, Runner, Stopped, plan
from trunnion.batch.preparation.case_parameters import Preparer
from trunnion.batch.sweep_result import Sweep, trajectory
from trunnion.batch.tables.table_merge import TableMerge
from trunnion.scene.overrides import Given, scene_given
from trunnion.scene.units.python_arguments import Amount, Names, names_given
from trunnion.simulation.settings.run_settings import Run, settings_read, with_setting_docs

CHUNK_SECONDS = 0.25
FIRST_CHUNK, LARGEST_CHUNK = 16, 20_000
LOOK_SECONDS = 0.1
"""Interval at which the main thread checks for Ctrl-C, s."""
SweepProgress = Callable[[int, int], None]
"""A function that is called a few times a second with (number of finished cases, number of all cases)."""


@with_setting_docs("trunnion.sweep")
def sweep(
    scene: Given,
    vary: Mapping[str, Any] | None = None,
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
    cpu_limit: Amount | None = None,
    max_steps: Amount | None = None,
    workers: int | None = None,
    progress: SweepProgress | None = None,
) -> Sweep:
    """Run a scene over many values of its numbers.

    Give exactly one of ``vary``, ``cases`` and ``sample``. A failed case also has a row, with its outcome. Reductions are computed
    from the rows that ``simulate`` gives with the same settings. After Ctrl-C, the result holds the finished cases, and
    ``cancelled`` is set. If no case has finished, KeyboardInterrupt is raised.

    Args:
        scene: as for ``simulate``.
        vary: a grid, {"joints.ball.friction.mu": "0.1:0.6:26", …}, or lists of values; every combination is a case.
        cases: a list, [{path: value, …}, …].
        sample: ranges, {path: (low, high)}, or distributions "normal(mean, deviation)", "lognormal(mean, deviation)",
            "triangular(low, mode, high)".
        count: number of cases of the sample.
        seed: seed of the sample.
        sampling: "latin", "random", "sobol" or "saltelli". ``indices`` needs "saltelli".
        reductions: "max:PATTERN", min, mean or final of columns, "first:EVENT", "count:EVENT", or "error:…" of any of these.
        trajectories: patterns of columns whose rows are stored.
        spacing: spacing of the stored rows, s; default: all rows.
        certify: whether to estimate the errors of all reductions, by two runs of each case.
        overrides: changes of the scene for all cases, {path: value}.
        workers: number of threads; default: one thread per core.
        progress: called with (number of finished cases, number of all cases).

    Returns:
        The sweep with a row for each case.

    Raises:
        SceneError: for wrong input.
    """
    loaded = scene_given(scene, overrides)
    asked = {"until": until, "every": every, "rtol": rtol, "method": method, "kernel": kernel}
    asked |= {"cpu_limit": cpu_limit, "max_steps": max_steps}
    values, wrong = settings_read("trunnion.sweep", asked)
    run, keep = Run(**values), names_given(reductions)
    rows: dict[str, Any] = {"trajectories": names_given(trajectories), "spacing": spacing, "certify": certify}
    ways: dict[str, Any] = {"count": count, "seed": seed, "sampling": sampling}
    chosen = plan(loaded, vary, cases, sample, **ways, keep=keep, run=run, wrong=wrong, **rows)
    return run_plan(chosen, workers, progress)


def run_plan(of: Plan, workers: int | None = None, progress: SweepProgress | None = None) -> Sweep:
    """Run a plan on several threads. The C loop releases the lock of Python's interpreter. KeyboardInterrupt if Ctrl-C comes before
    a case has finished."""
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


def _await(waiting: list[Future[None]], work: _Work, interrupt: DeferredInterrupt) -> None:
    """Wait for the threads. Raises KeyboardInterrupt after Ctrl-C. Errors of threads after Ctrl-C are ignored."""
    left: set[Future[None]] = set(waiting)
    while left:
        done, left = wait(left, LOOK_SECONDS, FIRST_EXCEPTION)
        if interrupt.asked:
            raise KeyboardInterrupt
        for w in done:
            w.result()


class _Work:
    """The work of a sweep: its chunks in order, and their tables by first case. The size of a chunk follows from the time of the
    thread's previous chunk."""

    def __init__(self, of: Plan, progress: SweepProgress | None):
        self.plan, self.progress = of, progress
        self.lock = threading.Lock()
        self.next = self.done = 0
        self.tables, self.rows = TableMerge(), TableMerge()
        self.runners: list[Runner] = []
        self.preparer = Preparer(of.scene, of.cases.paths, of.run, of.cases.ends)
        self.stopped = self.interrupted = False
        self.told = time.perf_counter()

    def take(self) -> None:
        """Run chunks in one thread, until no chunk is left or the work is stopped."""
        with watched(self._look), suppress(Unwanted):  # ``_look`` raises Unwanted between chunks
            self._take()

    def _take(self) -> None:
        runner, size = Runner(self.plan, self.preparer), FIRST_CHUNK
        with self.lock:
            self.runners.append(runner)
        while not self.stopped:
            with self.lock:
                start, stop = self.next, min(self.next + size, self.plan.cases.count)
                self.next = stop
            if start == stop:
                return
            before, began = runner.seconds, time.thread_time()
            try:
                got = runner.chunk(start, stop, self.go_on)
            except Stopped as s:
                got = s.table
            spent = max(runner.seconds - before, 0.5 * (time.thread_time() - began - runner.build_seconds), 1e-6)
            size = int(min(max(1, (stop - start) * CHUNK_SECONDS / spent, 1), 4 * size, LARGEST_CHUNK))
            self._finished(start, got, runner.rows)

    def go_on(self, done: int) -> bool:
        """Whether the thread continues its chunk. The loop calls this function every few hundredths of a second. done: number of
        finished cases of the chunk."""
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
        """The sweep with all tables joined. After an interrupt, the table's metadata state how many cases are finished."""
        table = self.tables.whole()
        cancelled = table.num_rows < self.plan.cases.count
        if cancelled:
            told = {"cancelled": f"{table.num_rows} of {self.plan.cases.count} cases finished"}
            table = table.replace_schema_metadata((table.schema.metadata or {}) | told)
        seconds = sum(r.seconds for r in self.runners)
        build = max((r.build_seconds for r in self.runners), default=0.0)
        kept = self.rows.whole() if self.plan.series is not None else None
        return Sweep(self.plan, table, wall, seconds, build, cancelled, kept)


__all__ = ["Sweep", "run_plan", "sweep", "trajectory"]
