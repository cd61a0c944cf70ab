"""Load of 200 polling and 20 submitting clients for a minute: errors, and the duration of GET /v1/jobs/{id}.

Run it with ``python -m tests.benchmarks.service.client_load [SECONDS]``. Clients are threads of four other processes.
"""

from __future__ import annotations

import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import httpx
import numpy as np

from tests.service.http_servers import MU, SMALL, Served, eventually

POLLERS, SUBMITTERS, PROCESSES = 200, 20, 4
PAUSE = 1.0
"""Seconds for which a poller waits between two requests."""


def poll(url: str, job: str, end: float) -> tuple[list[float], int]:
    """Request a job repeatedly: (seconds of each request, number of errors)."""
    took, errors = [], 0
    with httpx.Client(base_url=url, timeout=30) as client:
        while time.time() < end:
            began = time.perf_counter()
            try:
                errors += client.get(f"/v1/jobs/{job}").status_code != 200
            except httpx.HTTPError:
                errors += 1
            took.append(time.perf_counter() - began)
            time.sleep(PAUSE)
    return took, errors


def submit(url: str, number: int, end: float) -> tuple[list[float], int]:
    """Submit small jobs, one after another."""
    took, errors = [], 0
    with httpx.Client(base_url=url, timeout=30) as client:
        while time.time() < end:
            body = SMALL | {"vary": {MU: [0.1 + 0.01 * number, 0.5]}, "label": f"load {number}"}
            began = time.perf_counter()
            try:
                errors += client.post("/v1/jobs", json=body).status_code != 202
            except httpx.HTTPError:
                errors += 1
            took.append(time.perf_counter() - began)
            time.sleep(PAUSE)
    return took, errors


def clients(share: tuple[str, str, int, int, float]) -> tuple[list[float], list[float], int]:
    """Run the share of the clients that belongs to one process."""
    url, job, pollers, submitters, end = share
    with ThreadPoolExecutor(pollers + submitters) as pool:
        polls = [pool.submit(poll, url, job, end) for _ in range(pollers)]
        submits = [pool.submit(submit, url, i, end) for i in range(submitters)]
        done = [f.result() for f in polls], [f.result() for f in submits]
    return [x for t, _ in done[0] for x in t], [x for t, _ in done[1] for x in t], sum(e for part in done for _, e in part)


def load(seconds: float, folder: Path) -> dict[str, Any]:
    """Put a server under load for some seconds and return the figures to print."""
    with Served(folder / "data", "--workers", "2") as s:
        eventually(lambda: s.get("/readyz").status_code == 200)
        job = s.submit(SMALL)
        s.ended(job)
        url, end = f"http://127.0.0.1:{s.port}", time.time() + seconds
        with get_context("spawn").Pool(PROCESSES) as pool:
            parts = pool.map(clients, [(url, job, POLLERS // PROCESSES, SUBMITTERS // PROCESSES, end)] * PROCESSES)
    polls = np.array([x for p in parts for x in p[0]])
    submits = np.array([x for p in parts for x in p[1]])
    return {"polls": polls, "submits": submits, "errors": sum(p[2] for p in parts)}


def main() -> None:
    """Print the figures."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 60.0
    with tempfile.TemporaryDirectory() as folder:
        got = load(seconds, Path(folder))
    for name, label in (("polls", "GET /v1/jobs/{id}"), ("submits", "POST /v1/jobs")):
        p50, p99 = np.percentile(got[name], [50, 99])
        most = 1e3 * got[name].max()
        print(f"{label}: {len(got[name])} requests, median {1e3 * p50:.1f} ms, p99 {1e3 * p99:.1f} ms, longest {most:.0f} ms")
    print(f"errors: {got['errors']}")


if __name__ == "__main__":
    main()
