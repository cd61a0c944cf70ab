"""What a Dask worker does: one chunk of a job, into one Parquet part. Plans, kernels and blocks are kept between chunks."""

from __future__ import annotations

import json
import os
import socket
import threading
import time
from collections import OrderedDict
from typing import Any

from engine.basics.interrupts import watched
from engine.batch.plan import Runner, Stopped
from service.executor.parts import Parts, outcomes
from service.request import plan_of_document

KEPT = 4
MARKER_SECONDS = 0.1
"""Between two looks whether the job was stopped, at least; where parts are far away so much longer"""
LOOKS_PART = 0.05
"""that looking takes no larger part of the time."""
_local = threading.local()


class OutOfTime(RuntimeError):
    """The chunk ran into the job's time budget."""


class Cancelled(RuntimeError):
    """Raised in a worker whose job was stopped."""


def run_chunk(url: str, job: str, start: int, stop: int, seconds: float) -> dict[str, Any]:
    """Run the cases start … stop − 1 and write their part; what the store wants to know of it.

    url: where parts and the job's document are. seconds: most this chunk may build and step. A part that is there already is taken
    as it is.
    """
    parts = Parts(url)
    path = parts.part(job, start, stop)
    there = parts.counted(path)
    if there is not None:
        return {"counts": there[0], "seconds": 0.0, "build_seconds": 0.0, "bytes": there[1], "worker": _name()}
    watch = Watch(parts, job, seconds)
    with watched(watch.look):
        runner = _runner(parts, job)
        stepped, built = runner.seconds, runner.build_seconds
        table = runner.chunk(start, stop, watch)
    size = parts.write_table(path, table)
    spent = {"seconds": runner.seconds - stepped, "build_seconds": runner.build_seconds - built}
    return {"counts": outcomes(table), "bytes": size, "worker": _name(), **spent}


class Watch:
    """Called every few hundredths of a second while it builds and steps; ends the chunk by an exception when it is out of time or
    was cancelled."""

    def __init__(self, parts: Parts, job: str, seconds: float):
        self.parts, self.end = parts, time.monotonic() + seconds
        self.marker, self.looked = parts.marker(job), time.monotonic()
        self.pause = MARKER_SECONDS

    def __call__(self, done: int) -> bool:
        self.look()
        return True

    def look(self) -> None:
        """Raise when it is time to."""
        now = time.monotonic()
        if now > self.end:
            raise OutOfTime("the job's time budget is used up")
        if now - self.looked > self.pause:
            stopped = self.parts.exists(self.marker)
            self.looked = time.monotonic()
            self.pause = max(MARKER_SECONDS, (self.looked - now) / LOOKS_PART)
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


def _runner(parts: Parts, job: str) -> Runner:
    """This thread's runner of a job."""
    kept: OrderedDict[tuple[str, str], Runner] = _local.__dict__.setdefault("runners", OrderedDict())
    key = (parts.url, job)
    if key not in kept:
        kept[key] = Runner(plan_of_document(json.loads(parts.read(parts.job_file(job)))))
    kept.move_to_end(key)
    while len(kept) > KEPT:
        kept.popitem(last=False)
    return kept[key]


def run_trajectory(url: str, job: str, case: int, outputs: list[str] | None, kind: str) -> bytes:
    """One case again with all its rows: an Arrow stream (``table``), or the page of its moving picture (``animation``)."""
    from engine.batch.sweeping import trajectory
    from engine.plots.animate import page
    from engine.plots.mechanism import needed

    with watched(Wanted().look):
        plan = _runner(Parts(url), job).plan
        if kind == "animation":
            return page(trajectory(plan, case, needed(plan.scene))).encode()
        return arrow_bytes(trajectory(plan, case, outputs).to_arrow())


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
