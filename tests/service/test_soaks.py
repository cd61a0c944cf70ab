"""Slow evidence about the service, with its figures printed: ``python -m pytest tests/service/test_soaks.py -m slow -n 0 -s``."""

from __future__ import annotations

import threading
import time
from pathlib import Path

import httpx
import numpy as np
import psutil
import pytest

from tests.service.serving import MU, SMALL, Served, eventually, new_keys
from tests.service.test_hostile import crowd

pytestmark = pytest.mark.slow
HOSTILE_SECONDS, ORDINARY, HOSTILE = 60.0, 50, 45


class Clients:
    """Ordinary clients: each looks at a job and at readiness, and checks a scene now and then. taken: s of each answer, by what."""

    def __init__(self, s: Served, key: str, job: str, stop: threading.Event):
        self.s, self.key, self.job, self.stop = s, key, job, stop
        self.taken: dict[str, list[float]] = {"status": [], "ready": [], "check": []}
        self.errors: list[str] = []
        self.threads = [threading.Thread(target=self.go_on, args=(i,)) for i in range(ORDINARY)]
        for t in self.threads:
            t.start()

    def go_on(self, i: int) -> None:
        """What one of them does."""
        with httpx.Client(base_url=self.s.client.base_url, timeout=60, headers={"X-API-Key": self.key}) as c:
            for n in range(10**9):
                if self.stop.wait(0.5):
                    return
                self.one("status", c, "GET", f"/v1/jobs/{self.job}")
                self.one("ready", c, "GET", "/readyz")
                if n % 20 == i % 20:
                    self.one("check", c, "POST", "/v1/scenes/check", json={"scene": "spherical_pendulum"})

    def one(self, what: str, c: httpx.Client, method: str, path: str, **more: object) -> None:
        """Send one request and note what became of it."""
        began = time.perf_counter()
        try:
            answer = c.request(method, path, **more)  # type: ignore[arg-type]
            if answer.status_code != 200:
                self.errors.append(f"{path}: {answer.status_code} {answer.text[:200]}")
        except httpx.HTTPError as e:
            self.errors.append(f"{path}: {e!r}")
        self.taken[what].append(time.perf_counter() - began)


def memory(s: Served) -> float:
    """Bytes of the server and of its clerks, without its workers."""
    assert s.process is not None
    server = psutil.Process(s.process.pid)
    clerks = [p for p in server.children() if "spawn_main" in " ".join(p.cmdline())]
    return float(sum(p.memory_info().rss for p in [server, *clerks]))


def test_a_minute_of_hostile_checks_by_a_reader_costs_fifty_others_nothing(tmp_path: Path) -> None:
    with Served(tmp_path / "data", "--workers", "1", "--keys") as s:
        reader, own = new_keys(s, "read", "submit")
        s.client.headers["X-API-Key"] = own
        job = s.submit(SMALL | {"over": {MU: "0.1:0.6:40"}})
        s.ended(job)
        eventually(lambda: s.get("/readyz").status_code == 200)
        stop = threading.Event()
        threads = crowd(str(s.client.base_url), reader, stop, HOSTILE)
        clients, most = Clients(s, own, job, stop), 0.0
        end = time.monotonic() + HOSTILE_SECONDS
        while time.monotonic() < end:
            most = max(most, memory(s))
            time.sleep(0.5)
        stop.set()
        for t in [*threads, *clients.threads]:
            t.join()
        for what, taken in clients.taken.items():
            p50, p99, worst = np.percentile(taken, [50, 99, 100])
            print(f"\n{what}: {len(taken)} answers, median {p50:.3f} s, p99 {p99:.3f} s, longest {worst:.3f} s", end="")
        print(f"\nmemory {most / 1e6:.0f} MB, errors {len(clients.errors)}")
        assert clients.errors == []
        assert np.percentile(clients.taken["status"], 99) <= 0.5  # s
        assert most <= 1e9
