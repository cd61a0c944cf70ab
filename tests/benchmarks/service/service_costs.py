"""Processor time that the service needs in addition to the engine: ``python -m tests.benchmarks.service.service_costs``.

Cost of a case: time of the whole server with its worker for jobs of many cases of example 8.1. The time of the same chunks in the
engine alone is subtracted; both measurements alternate in pairs. Cost of a job of one case: time from its submission to its end,
minus the cost of the case. Cost of a status: ``GET /v1/jobs/{id}``. The loop: the longest callback of the server's event loop while
96 jobs are in flight, by the processor time of its thread."""

from __future__ import annotations

import json
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import psutil

from tests.service.http_servers import MU, ROOT, SMALL, Served, eventually
from trunnion.batch.plan_and_runner import Runner
from trunnion.service.basics.server_settings import Limits
from trunnion.service.request_models.job_request import JobRequest, plan_of_request

CASES, PAIRS, ONES, STATUSES, FLYING = 20_000, 5, 40, 1000, 96
WATCH = """import asyncio.events, json, os, sys, threading, time
sys.path.append({root!r})
longest, run = [], asyncio.events.Handle._run

def timed(self):
    if threading.current_thread() is not threading.main_thread():
        return run(self)
    began = time.thread_time()
    try:
        return run(self)
    finally:
        took = time.thread_time() - began
        if took > (longest[-1][0] if len(longest) == 5 else 0.002) and os.path.exists({file!r} + ".begun"):
            longest[:] = sorted([*longest, (took, repr(self)[:300])], reverse=True)[:5]
            open({file!r}, "w").write(json.dumps(longest))

if "serve" in sys.argv:
    asyncio.events.Handle._run = timed
"""


def used(s: Served) -> float:
    """Processor time of the server and of its processes so far, s."""
    assert s.process is not None
    server = psutil.Process(s.process.pid)
    return float(sum(sum(p.cpu_times()[:2]) for p in (server, *server.children(recursive=True))))


def settled(s: Served) -> float:
    """The value of ``used`` when the server has no more work."""
    before = used(s)
    while True:
        time.sleep(0.5)
        now = used(s)
        if now - before < 0.06:
            return now
        before = now


def alone(asked: dict[str, Any]) -> float:
    """Processor time of the same cases in the engine, s."""
    runner = Runner(plan_of_request(JobRequest(**asked), Limits()))
    runner.chunk(0, 10)
    began = time.process_time()
    for start in range(0, runner.plan.cases.count, 2000):
        runner.chunk(start, min(start + 2000, runner.plan.cases.count))
    return time.process_time() - began


def during(s: Served, work: Callable[[], object]) -> float:
    """Processor time of the server while it does some work, s. The time of an idle server in the same period is subtracted."""
    began, clock = settled(s), time.monotonic()
    work()
    taken, waited = settled(s) - began, time.monotonic() - clock
    idle, clock = used(s), time.monotonic()
    time.sleep(5.0)
    return taken - waited * (used(s) - idle) / (time.monotonic() - clock)


def run(s: Served, *jobs: dict[str, Any]) -> None:
    """Submit jobs, and wait until the last job has ended."""
    sent = [s.submit(asked) for asked in jobs]
    while s.job(sent[-1])["state"] not in ("done", "failed"):
        time.sleep(2.0)  # each request for the status costs the server time


def main() -> None:
    """Print the figures."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        (place / "own").mkdir()
        (place / "own" / "sitecustomize.py").write_text(WATCH.format(root=str(ROOT), file=str(place / "longest")))
        with Served(place / "data", "--workers", "1", "--limit", "waiting=200") as s:
            many = SMALL | {"vary": {MU: f"0.1:0.6:{CASES}"}, "reductions": ["max:ball.contact[1].normal_force", "first:reversal"]}
            s.ended(s.submit(SMALL))
            found = [1e3 * (during(s, lambda: run(s, many)) - alone(many)) / CASES for _ in range(PAIRS)]
            print(f"a case: {min(found):.3f} ms, median {statistics.median(found):.3f}, of {PAIRS} pairs", flush=True)
            ones = [SMALL | {"vary": {MU: [0.1 + 0.01 * k]}} for k in range(ONES)]
            bare = alone(many) / CASES
            found = [1e3 * (during(s, lambda: run(s, *ones)) / ONES - bare) for _ in range(3)]
            print(f"a job of one case: {min(found):.1f} ms, median {statistics.median(found):.1f}", flush=True)
            job, found = s.submit(SMALL), []
            s.ended(job)
            for _ in range(PAIRS):
                found.append(1e3 * during(s, lambda: [s.job(job) for _ in range(STATUSES)]) / STATUSES)
            print(f"a status: {min(found):.2f} ms, median {statistics.median(found):.2f}", flush=True)
        with Served(place / "flying", "--workers", "1", "--limit", "waiting=200", paths=[str(place / "own")]) as s:
            s.ended(s.submit(SMALL))
            (place / "longest.begun").touch()  # the first requests load modules of the server; the measurement begins after them
            jobs = [s.submit(SMALL | {"vary": {MU: f"0.1:0.6:{20 + k}"}}) for k in range(FLYING)]
            eventually(lambda: all(s.job(job)["state"] == "done" for job in jobs))
            longest = json.loads((place / "longest").read_text()) if (place / "longest").exists() else []
            print(f"{FLYING} jobs, longest callbacks, ms:", *(f"\n{1e3 * t:.1f} {who}" for t, who in longest))


if __name__ == "__main__":
    main()
