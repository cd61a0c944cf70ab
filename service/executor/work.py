"""What a Dask worker does: one chunk of a job, into one Parquet part. Plans, kernels and blocks are kept between chunks."""

from __future__ import annotations

import json
import os
import socket
import threading
import time
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import inf, isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from engine.basics.interrupts import watched
from engine.batch.plan import Runner, Stopped
from engine.fits.cases import FitPlan, FitRunner
from engine.studies.following import Told
from service.executor.parts import Parts, outcomes
from service.executor.sealed import Piece, Spoiled, digest_of
from service.executor.stages import DERIVING, RUNNING, Tell, staged
from service.executor.tallied import is_tallied, write_tally
from service.plain import text_of
from service.request import plan_of_document

if TYPE_CHECKING:
    from engine.simulation.result import Result

KEPT = 4
MOST_EVENTS = 2000
MARKER_SECONDS = 0.1
"""Between two looks whether the job was stopped, at least; where parts are far away so much longer"""
LOOKS_PART = 0.05
"""that looking takes no larger part of the time."""
_local = threading.local()
Values = Sequence[Sequence[float]] | None


class OutOfTime(RuntimeError):
    """The chunk had no more time, while it built."""


class Cancelled(RuntimeError):
    """Raised in a worker whose job was stopped."""


def run_chunk(
    url: str, piece: Piece, seconds: float, longest: float = inf, values: Values = None, pause: float = 0.0
) -> dict[str, Any]:
    """Run the cases of a piece and write their part; what the store wants to know of it (``Done``).

    url: where parts and the job's document are. seconds: most this chunk may build and step; longest: most it may step. A chunk
    that overruns leaves off at once: its part has the cases that were finished before. A part that is there already, and fits, is
    taken as it is. values: the numbers of the cases, where those follow from results; pause: s between two looks whether the job
    was stopped, at least.
    """
    parts = Parts(url)
    start, stop = piece.start, piece.stop
    there = parts.counted(piece)
    if there is not None:
        return {"counts": there[0], "seconds": 0.0, "build_seconds": 0.0, "bytes": there[1], "worker": _name()}
    runner = _runner(parts, piece.job, piece.document)
    built, stepped, began = runner.build_seconds, runner.seconds, time.thread_time()
    watch = Watch(parts, piece.job, seconds, longest, pause)
    if values is not None and isinstance(runner.plan.cases.values, Told):
        runner.plan.cases.values.tell(start, values)
    with watched(watch.look), staged(parts, piece.job, wanted=start == 0) as watch.tell:
        watch.tell(DERIVING if runner.plan.kernel == "compiled" else RUNNING)
        try:
            table, reached = runner.chunk(start, stop, watch), stop
        except Stopped as overran:
            table, reached = _together(overran.table, start)
    size = _written(parts, replace(piece, stop=reached), table, runner) if reached > start else 0
    build = runner.build_seconds - built
    spent = {"seconds": max(runner.seconds - stepped, time.thread_time() - began - build), "build_seconds": build}
    return {"counts": outcomes(table), "bytes": size, "worker": _name(), "reached": reached, **spent}


def _written(parts: Parts, piece: Piece, table: Any, runner: Runner | FitRunner) -> int:
    """Write what there is of a piece; its size in bytes."""
    size = 0
    if runner.plan.series is not None and runner.rows is not None:
        kept = runner.rows.filter(runner.rows["case"].to_numpy() < piece.stop)
        size = parts.write_rows(piece, kept)
    if is_tallied(runner.plan):
        size += write_tally(parts, piece, runner.plan, table)
    return size + parts.write_part(piece, table)


def _together(table: Any, start: int) -> tuple[Any, int]:
    """Of the cases that were finished those before the first that was not, and the number of that."""
    there = table["case"].to_numpy() == start + np.arange(len(table))
    n = len(table) if there.all() else int(there.argmin())
    return table.slice(0, n), start + n


class Watch:
    """Called every few hundredths of a second while it builds and steps; ends the chunk when it is out of time, keeping the cases
    it has finished, and by an exception when it was cancelled, or is out of time while it builds."""

    def __init__(self, parts: Parts, job: str, seconds: float, longest: float = inf, pause: float = 0.0):
        self.parts, self.end, self.longest = parts, time.monotonic() + seconds, longest
        self.stepping = inf
        self.tell: Tell = lambda stage: None
        self.marker, self.looked = parts.marker(job), time.monotonic()
        self.least = self.pause = max(MARKER_SECONDS, pause)

    def __call__(self, done: int) -> bool:
        now = time.monotonic()
        if self.stepping > now:
            self.stepping = now
            self.tell(RUNNING)
        self._wanted(now)
        return now < self.end and now - self.stepping < self.longest

    def look(self) -> None:
        """Raise when it is time to."""
        now = time.monotonic()
        if now > self.end:
            raise OutOfTime("the time of the chunk is used up")
        self._wanted(now)

    def _wanted(self, now: float) -> None:
        """Raise when the job was stopped."""
        if now - self.looked > self.pause:
            stopped = self.parts.exists(self.marker)
            self.looked = time.monotonic()
            self.pause = max(self.least, (self.looked - now) / LOOKS_PART)
            if stopped:
                raise Cancelled("the job was stopped")


class Wanted:
    """Ends work on one answer by an exception when the task this thread works on has been cancelled: its client has gone."""

    def __init__(self) -> None:
        self.looked = time.monotonic()

    def look(self) -> None:
        """Raise when nobody waits any more."""
        from distributed import get_worker

        now = time.monotonic()
        if now - self.looked > MARKER_SECONDS:
            self.looked = now
            worker = get_worker()
            task = worker.state.tasks.get(worker.get_current_task())
            if task is None or task.state == "cancelled":
                raise Cancelled("nobody waits for it any more")


def _runner(parts: Parts, job: str, digest: str) -> Runner | FitRunner:
    """This thread's runner of a job whose document has this digest; Spoiled when the file of the job is another."""
    kept: OrderedDict[tuple[str, str, str], Runner | FitRunner] = _local.__dict__.setdefault("runners", OrderedDict())
    key = (parts.url, job, digest)
    if key not in kept:
        try:
            data = parts.read(parts.job_file(job))
        except FileNotFoundError:
            data = b""
        if digest_of(data) != digest:
            raise Spoiled("the job's document beside its parts is not what was written")
        plan = plan_of_document(json.loads(data))
        kept[key] = FitRunner(plan) if isinstance(plan, FitPlan) else Runner(plan)
    kept.move_to_end(key)
    while len(kept) > KEPT:
        kept.popitem(last=False)
    return kept[key]


def forget() -> None:
    """Drop this thread's runners."""
    _local.__dict__.pop("runners", None)


def run_trajectory(
    url: str, job: str, digest: str, case: int, outputs: list[str] | None, kind: str, changes: Mapping[str, float] | None = None
) -> bytes:
    """One case again with all its rows: an Arrow stream (``table``, or ``certified`` with errors), the page of its moving picture
    (``animation``), or its events as JSON (``events``). changes: its numbers, where they follow from results."""
    from engine.batch.sweeping import trajectory
    from engine.plots.animate import page
    from engine.plots.mechanism import needed

    with watched(Wanted().look):
        plan = _runner(Parts(url), job, digest).plan
        if kind == "animation":
            return page(trajectory(plan, case, needed(plan.scene), changes)).encode()
        if kind == "events":
            return events_bytes(trajectory(plan, case, outputs, changes))
        return arrow_bytes(trajectory(plan, case, outputs, changes, kind == "certified").to_arrow())


def events_bytes(result: Result) -> bytes:
    """The outcome of a run and its first events, as JSON."""
    from engine.plots.captions import event_text

    told = [{"time": e.time, "kind": e.kind, "joint": e.joint, "text": event_text(e)} for e in result.events[:MOST_EVENTS]]
    o = result.outcome
    end = {"name": o.name, "time": o.time if isfinite(o.time) else None, "joint": o.joint, "advice": o.advice}
    return text_of({"events": told, "count": len(result.events), "outcome": end})


def arrow_bytes(table: Any) -> bytes:
    """A table as an Arrow stream."""
    import pyarrow as pa

    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, table.schema) as writer:
        writer.write_table(table)
    return bytes(sink.getvalue())


def _name() -> str:
    return f"{socket.gethostname()}:{os.getpid()}"


__all__ = ["Cancelled", "OutOfTime", "Stopped", "run_chunk", "run_trajectory"]
