"""Functions that run on Dask workers. They compute a chunk of a job and write it as a Parquet file (part), run one case again, or
compute a run with derivatives. A worker caches the compiled scenes (runners) between chunks."""

from __future__ import annotations

import json
import os
import socket
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import inf, isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.analysis.fits.fits_as_batch_cases import FitPlan, FitRunner
from trunnion.analysis.studies.study_rounds import ReportedCases
from trunnion.basics.arrow_columns import count_by
from trunnion.basics.errors import Problem, SceneError
from trunnion.basics.interrupts import watched
from trunnion.batch.plan_and_runner import Runner, Stopped
from trunnion.scene.scene_loader import scene_from_dict
from trunnion.service.basics.engine_version import engine_version
from trunnion.service.basics.json_text import text_of
from trunnion.service.basics.recently_used_cache import RecentItems
from trunnion.service.executor.job_stage import DERIVING, RUNNING, Tell, report_stages
from trunnion.service.executor.parquet_parts import Parts
from trunnion.service.executor.part_file_format import CaseRange, CorruptPart, digest_of
from trunnion.service.executor.part_versions import computed_by
from trunnion.service.request_models.job_request import plan_of_document

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]

if TYPE_CHECKING:
    from trunnion.simulation.results.result import Result

CACHED_RUNNERS = 4
MOST_EVENTS = 2000
MARKER_SECONDS = 0.1
"""Shortest time between two checks of the stop marker, s."""
CHECK_SHARE = 0.05
"""Largest share of the time that is spent on checks of the stop marker. With slow storage, workers check less often."""
_local = threading.local()
WALL_FACTOR = 10.0
"""Largest ratio of wall time to a limit of processor time. The ratio is large because the machine can be busy with other work."""
Values = Sequence[Sequence[float]] | None


class OutOfTime(RuntimeError):
    """The chunk used all its time before the kernel was built."""


class Cancelled(RuntimeError):
    """The job was stopped."""


def run_chunk(
    url: str, case_range: CaseRange, seconds: float, longest: float = inf, values: Values = None, pause: float = 0.0
) -> dict[str, Any]:
    """Run the cases of a chunk and write their results to a Parquet file, the chunk's part. Returns the fields of ``ChunkReport``.
    If a valid part exists, no case runs. A chunk that exceeds a limit stops at once. The part then contains the finished cases.
    url: location of the parts and of the job's document. case_range: the cases of the chunk. seconds: limit of the processor time
    of building and stepping together, s. longest: limit of stepping alone, s. values: parameter values of the cases of a study.
    pause: shortest time between two checks of the stop marker, s."""
    parts = Parts(url)
    start, stop = case_range.start, case_range.stop
    there = parts.part_outcomes(case_range)
    if there is not None:
        about = {"bytes": there[1], "worker": _worker_name(), "version": there[2]}
        return {"counts": there[0], "seconds": 0.0, "build_seconds": 0.0, **about}
    runner = _cached_runner(parts, case_range.job, case_range.document)
    built, stepped, began = runner.build_seconds, runner.seconds, processor_seconds()
    watch = ChunkMonitor(parts, case_range.job, seconds, longest, pause)
    if values is not None and isinstance(runner.plan.cases.values, ReportedCases):
        runner.plan.cases.values.report(start, values)
    with watched(watch.check), report_stages(parts, case_range.job, wanted=start == 0) as watch.tell:
        watch.tell(DERIVING if runner.plan.kernel == "compiled" else RUNNING)
        try:
            table, reached = runner.chunk(start, stop, watch), stop
        except Stopped as overran:
            table, reached = _finished_prefix(overran.table, start)
    size = _write_results(parts, replace(case_range, stop=reached), table, runner) if reached > start else 0
    work = max(processor_seconds() - began, runner.seconds - stepped)
    # build_seconds is wall time, which grows with other load of the machine
    build = min(runner.build_seconds - built, work - (runner.seconds - stepped))
    spent = {"seconds": work - build, "build_seconds": build}
    about = {"worker": _worker_name(), "version": engine_version()}
    return {"counts": count_by(table), "bytes": size, "reached": reached, **about, **spent}


def _write_results(parts: Parts, case_range: CaseRange, table: Any, runner: Runner | FitRunner) -> int:
    """Write the trajectory rows and the part of a range of cases. Returns the size of the files in bytes."""
    size = 0
    if runner.plan.series is not None and runner.rows is not None:
        kept = runner.rows.filter(runner.rows["case"].to_numpy() < case_range.stop)
        size = parts.write_rows(case_range, kept)
    return size + parts.write_part(case_range, computed_by(table, engine_version()))


def _finished_prefix(table: Any, start: int) -> tuple[Any, int]:
    """The rows of all cases before the first unfinished case, and the number of the unfinished case."""
    there = table["case"].to_numpy() == start + np.arange(len(table))
    n = len(table) if there.all() else int(there.argmin())
    return table.slice(0, n), start + n


def processor_seconds() -> float:
    """Processor time, s: the time of this thread plus the time of ended child processes, such as compilers."""
    if resource is None:
        return time.thread_time()
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.thread_time() + children.ru_utime + children.ru_stime


class ChunkMonitor:
    """Monitors the time limits of a chunk. The limits are processor times, so that other load of the machine does not count. The
    runner calls the monitor every few hundredths of a second during building and stepping. If a limit is reached while cases run,
    the monitor ends the chunk, and the finished cases are kept. The monitor raises Cancelled when the job was stopped, and
    OutOfTime when all time is used up during building. A chunk also ends when its wall time is WALL_FACTOR times its limit."""

    def __init__(self, parts: Parts, job: str, seconds: float, longest: float = inf, pause: float = 0.0):
        self.parts, self.seconds, self.longest = parts, seconds, longest
        self.thread, self.began, self.latest = threading.get_ident(), processor_seconds(), time.monotonic() + WALL_FACTOR * seconds
        self.stepping = inf
        self.tell: Tell = lambda stage: None
        self.marker, self.looked = parts.marker(job), time.monotonic()
        self.least = self.pause = max(MARKER_SECONDS, pause)

    def __call__(self, done: int) -> bool:
        used, now = processor_seconds(), time.monotonic()
        if self.stepping > used:
            self.stepping = used
            self.tell(RUNNING)
        self._check_stop_marker(now)
        return used - self.began < self.seconds and now < self.latest and used - self.stepping < self.longest

    def check(self) -> None:
        """Raise OutOfTime when the time is used up, and Cancelled when the job was stopped."""
        now, own = time.monotonic(), threading.get_ident() == self.thread  # other threads of a build check only the wall time
        if now > self.latest or (own and processor_seconds() - self.began > self.seconds):
            raise OutOfTime("the chunk used its whole time")
        self._check_stop_marker(now)

    def _check_stop_marker(self, now: float) -> None:
        """Raise Cancelled when the job was stopped."""
        if now - self.looked > self.pause:
            stopped = self.parts.exists(self.marker)
            self.looked = time.monotonic()
            self.pause = max(self.least, (self.looked - now) / CHECK_SHARE)
            if stopped:
                raise Cancelled("the job was stopped")


class RequestMonitor:
    """Raises Cancelled when the client of the current task has disconnected, and SceneError when the time, s, is used up."""

    def __init__(self, seconds: float = inf) -> None:
        self.seconds, self.looked = seconds, time.monotonic()
        self.end = self.looked + seconds

    def check(self) -> None:
        from distributed import get_worker

        now = time.monotonic()
        if now > self.end:
            hint = "request a shorter run, larger rtol, fewer parameters or a larger budget; a second request is faster"
            raise SceneError([Problem("budget", f"the time budget of {self.seconds:g} s is used up", hint)])
        if now - self.looked > MARKER_SECONDS:
            self.looked = now
            worker = get_worker()
            task = worker.state.tasks.get(worker.get_current_task())
            if task is None or task.state == "cancelled":
                raise Cancelled("the client has disconnected")


def _cached_runner(parts: Parts, job: str, digest: str) -> Runner | FitRunner:
    """The runner of a job in this thread. Raises CorruptPart when the stored document of the job does not have this digest."""

    def made() -> Runner | FitRunner:
        try:
            data = parts.read(parts.job_file(job))
        except FileNotFoundError:
            data = b""
        if digest_of(data) != digest:
            raise CorruptPart("the job's document beside its parts is damaged")
        plan = plan_of_document(json.loads(data))
        if isinstance(plan, FitPlan):
            return FitRunner(plan)
        return Runner(plan, earlier=next((r for r in kept.values() if isinstance(r, Runner) and r.plan.is_like(plan)), None))

    kept: RecentItems[tuple[str, str, str], Runner | FitRunner] = _local.__dict__.setdefault("runners", RecentItems(CACHED_RUNNERS))
    return kept.of((parts.url, job, digest), made)


def run_trajectory(
    url: str, job: str, digest: str, case: int, outputs: list[str] | None, kind: str, changes: Mapping[str, float] | None = None
) -> bytes:
    """Run one case again and return bytes. kind: ``table`` (an Arrow stream), ``certified`` (an Arrow stream with errors),
    ``animation`` (a page) or ``events`` (JSON). changes: parameter values, for a case of a study."""
    from trunnion.batch.sweep import trajectory
    from trunnion.plots.animation.html_or_film import page
    from trunnion.plots.mechanism_pictures.instant_picture import needed

    with watched(RequestMonitor().check):
        plan = _cached_runner(Parts(url), job, digest).plan
        if kind == "animation":
            return page(trajectory(plan, case, needed(plan.scene), changes)).encode()
        if kind == "events":
            return events_bytes(trajectory(plan, case, outputs, changes))
        return arrow_bytes(trajectory(plan, case, outputs, changes, kind == "certified").to_arrow())


def run_sensitivity(asked: dict[str, Any], seconds: float) -> bytes:
    """JSON of the values and derivatives along a run. asked: the scene as plain data, and the other arguments of
    ``trunnion.sensitivity``. Raises SceneError when the computation takes more than ``seconds``, and Cancelled when the client has
    disconnected."""
    from trunnion.analysis.sensitivities.sensitivity import sensitivity

    scene = scene_from_dict(asked.pop("scene"))
    check = RequestMonitor(seconds).check
    with watched(check):
        return text_of(sensitivity(scene, **asked, tick=check).document())


def events_bytes(result: Result) -> bytes:
    """JSON of the outcome and the first events of a run."""
    from trunnion.plots.style.captions import event_text

    told = [{"time": e.time, "kind": e.kind, "joint": e.joint, "text": event_text(e)} for e in result.events[:MOST_EVENTS]]
    o = result.outcome
    end = {"name": o.name, "time": o.time if isfinite(o.time) else None, "joint": o.joint, "advice": o.advice}
    return text_of({"events": told, "count": len(result.events), "outcome": end})


def arrow_bytes(table: Any) -> bytes:
    import pyarrow as pa

    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, table.schema) as writer:
        writer.write_table(table)
    return bytes(sink.getvalue())


def _worker_name() -> str:
    return f"{socket.gethostname()}:{os.getpid()}"
