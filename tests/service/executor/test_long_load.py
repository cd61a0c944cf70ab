"""Slow tests of the service, which print their figures: ``python -m pytest tests/service/executor/test_long_load.py -m slow -n 0
-s``."""

from __future__ import annotations

import http.client
import json
import random
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest

import trunnion
from tests.service.executor.test_failure_recovery import BRIM
from tests.service.http_servers import MU, ROOT, SMALL, InProcess, Served, as_stored, eventually, new_keys, spawned
from trunnion.scene.library.model_folders import bundled_names

pytestmark = pytest.mark.slow
HOSTILE_SECONDS, ORDINARY, HOSTILE = 60.0, 50, 45


class Clients:
    """Ordinary clients. Each client regularly requests a job and readiness, and sometimes checks a scene. taken: time of each
    answer, s, by request."""

    def __init__(self, s: Served, key: str, job: str, stop: threading.Event):
        self.s, self.key, self.job, self.stop = s, key, job, stop
        self.taken: dict[str, list[float]] = {"status": [], "ready": [], "check": []}
        self.errors: list[str] = []
        self.threads = [threading.Thread(target=self.go_on, args=(i,)) for i in range(ORDINARY)]
        for t in self.threads:
            t.start()

    def go_on(self, i: int) -> None:
        """Send requests until the test ends."""
        # httpx takes ten times as long, so the test would measure httpx
        c = http.client.HTTPConnection("127.0.0.1", self.s.port, timeout=60)
        for n in range(10**9):
            if self.stop.wait(0.5):
                c.close()
                return
            self.one("status", c, "GET", f"/v1/jobs/{self.job}")
            self.one("ready", c, "GET", "/readyz")
            if n % 20 == i % 20:
                self.one("check", c, "POST", "/v1/scenes/check", b'{"scene": "spherical_pendulum"}')

    def one(self, what: str, c: http.client.HTTPConnection, method: str, path: str, body: bytes | None = None) -> None:
        """Send one request and record its result."""
        began = time.perf_counter()
        try:
            c.request(method, path, body, {"X-API-Key": self.key, "Content-Type": "application/json"})
            answer = c.getresponse()
            text = answer.read()
            if answer.status != 200:
                self.errors.append(f"{path}: {answer.status} {text[:200]!r}")
        except (http.client.HTTPException, OSError) as e:
            self.errors.append(f"{path}: {e!r}")
        self.taken[what].append(time.perf_counter() - began)


def memory(s: Served) -> float:
    """Memory of the server and of its helper processes, without its workers, bytes."""
    assert s.process is not None
    server = psutil.Process(s.process.pid)
    workers = [p for p in server.children() if spawned(p)]
    return float(sum(p.memory_info().rss for p in [server, *workers]))


def beside(*words: str) -> subprocess.Popen[str]:
    """A process that measures the server. It is separate from this process, whose many threads wait for each other."""
    return subprocess.Popen(
        [sys.executable, "-W", "ignore", "-m", "tests.service.executor.load_generator", *words], cwd=ROOT, stdout=-1, text=True
    )


MANY: dict[str, Any] = {
    "ranges": {MU: [0.1, 0.6], "joints.ball.friction.radius": [0.04, 0.06]},
    "count": 8192,
    "method": "saltelli",
}


@pytest.mark.parametrize("what", ["checks", "results", "bins"])
def test_a_minute_of_hostile_requests_by_a_reader_costs_fifty_others_nothing(tmp_path: Path, what: str) -> None:
    with Served(tmp_path / "data", "--workers", "1", "--keys") as s:
        reader, own = new_keys(s, "read", "submit")
        s.client.headers["X-API-Key"] = own
        job = s.submit(SMALL | {"vary": {MU: "0.1:0.6:40"}})
        s.ended(job)
        eventually(lambda: s.get("/readyz").status_code == 200)
        stop, url = threading.Event(), str(s.client.base_url)
        if what == "checks":
            hostile = beside("crowd", url, reader, str(HOSTILE))
        else:  # the readers request rows of a job of 49,152 cases
            large = s.submit(SMALL | {"vary": None, "sample": MANY, "until": 0.02})
            s.ended(large, 600.0)
            path = f"/v1/jobs/{large}/results?format=json" if what == "results" else f"/v1/jobs/{large}/bins?x={MU}&nx=200"
            hostile = beside("readers", url, reader, str(HOSTILE), path)
        asking = beside("probe", url, own, "/readyz", str(HOSTILE_SECONDS))
        clients, most = Clients(s, own, job, stop), 0.0
        end = time.monotonic() + HOSTILE_SECONDS
        while time.monotonic() < end:
            most = max(most, memory(s))
            time.sleep(0.5)
        assert hostile.poll() is None, "the crowd has gone"
        stop.set()
        hostile.kill()
        ready = json.loads(asking.communicate()[0])
        for t in clients.threads:
            t.join()
        for what, taken in (clients.taken | {f"readiness from outside, {n}": x for n, x in ready.items()}).items():
            p50, p99, worst = np.percentile(taken, [50, 99, 100])
            print(f"\n{what}: {len(taken)} answers, median {p50:.4f} s, p99 {p99:.4f} s, longest {worst:.4f} s", end="")
        print(f"\nmemory {most / 1e6:.0f} MB, errors {len(clients.errors)}")
        assert clients.errors == []
        assert np.percentile(clients.taken["status"], 99) <= 0.5  # limit in s
        # limits in s, in addition to the answer time of an idle process on this machine
        assert np.percentile(ready["asked"], 99) <= 0.1 + np.percentile(ready["idle"], 99)
        assert most <= 1e9


def test_each_of_two_hundred_spoilt_parts_is_found_and_computed_again(tmp_path: Path) -> None:
    chance, spoilt = random.Random(16), dict.fromkeys(("flipped", "exchanged", "cut off", "removed"), 0)
    with Served(tmp_path / "data", "--workers", "2", "--chunk-seconds", "0.2") as s:
        job = s.submit(SMALL | {"vary": {MU: "0.1:0.6:2000"}, "until": 5.0})
        assert s.ended(job)["state"] == "done"
        before, folder = s.rows(job), tmp_path / "data" / "results" / job
        wrong = 0
        for i in range(200):
            parts = sorted(folder.glob("part-*"))
            file, other = chance.sample(parts, 2)
            how = chance.choice(list(spoilt)) if i % 2 else "flipped"
            data = bytearray(file.read_bytes())
            if how == "flipped":
                at = chance.randrange(8 * len(data))
                data[at // 8] ^= 1 << at % 8
            if how == "exchanged":
                data = bytearray(other.read_bytes())
            if how == "cut off":
                data = data[: chance.randrange(len(data))]
            file.unlink() if how == "removed" else file.write_bytes(data)
            spoilt[how] += 1
            wrong += sum(a != b for a, b in zip(s.rows(job), before, strict=True))
        told = [x for x in s.get(f"/v1/jobs/{job}/attempts").json() if x["result"].startswith("done")]
        print(f"\n{len(parts)} parts; spoilt: {spoilt}; {wrong} wrong rows; {len(told)} chunks computed")
        assert wrong == 0
        assert s.ended(job)["done"] == 2000


FIRST = (".friction.mu", ".friction.", ".start.")
"""Numbers that the page proposes to vary, best first (``run_form.js``)."""


@pytest.mark.parametrize("name", bundled_names())
def test_the_pages_own_sweep_of_every_bundled_model_ends(server: InProcess, name: str) -> None:
    text = server.get(f"/v1/models/{name}").json()["text"]
    facts = server.post("/v1/scenes/check", {"scene_text": text}).json()
    numbers = facts["parameters"]
    chosen = next((p for f in FIRST for p in numbers if f in p["path"]), numbers[0])
    low, high = sorted((chosen["value"] / 2, chosen["value"] * 1.5)) if chosen["value"] else (0.0, 1.0)
    over = {chosen["path"]: f"{low:.4g}:{high:.4g}:21"}
    asked = {"scene_text": text, "reductions": facts["reductions"][:8], "until": facts["until"], "vary": over}
    end = server.ended(server.submit(asked), 1200.0)
    print(f"\n{name}: {end['outcomes']}, {end['stepping_seconds']:.1f} s of stepping", end="")
    assert (end["state"], end["done"]) == ("done", 21)


CLOCK = """import sys, time
sys.path.append({root!r})
try:
    shift = float(open({file!r}).read())
except OSError:
    shift = 0.0
steady = time.time
time.time = lambda: steady() + shift
"""


def test_twenty_thousand_cases_survive_kills_clocks_and_full_disks(tmp_path: Path) -> None:
    chance, kills, full_twice = random.Random(20), 10, {3, 7}
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "sitecustomize.py").write_text(CLOCK.format(root=str(ROOT), file=str(tmp_path / "shift")))
    (tmp_path / "results").mkdir()
    asked = SMALL | {"vary": {MU: "0.1:0.6:20000"}, "until": 100.0, "every": 0.02}
    options = ("--workers", "2", "--lease", "1", "--chunk-seconds", "0.3", "--retry-delay", "0.3")
    options = (*options, "--results", f"brim://{tmp_path / 'results'}")
    with Served(tmp_path / "data", *options, paths=[str(BRIM), str(tmp_path / "own")]) as s:
        job = s.submit(asked)
        for kill in range(kills):
            before = s.job(job)["done"]
            eventually(lambda b=before: s.job(job)["done"] > b + 300, 300.0)
            if kill in full_twice:
                (tmp_path / "results" / "FULL").write_text("part-\n")
                time.sleep(1.0)
                (tmp_path / "results" / "FULL").unlink()
            assert s.job(job)["state"] == "running"
            s.kill()
            (tmp_path / "shift").write_text(str(chance.choice((-3600.0, 0.0, 3600.0))))
            s.start()
        end = s.ended(job, 900.0)
        rows = s.rows(job)
    whole = trunnion.sweep(asked["scene"], asked["vary"], reductions=asked["reductions"], until=100.0, every=0.02)
    whole = as_stored(whole.table).to_pylist()
    wrong = sum(list(a.values()) != b for a, b in zip(whole, rows, strict=True))
    print(f"\n{end['done']} cases {end['state']}, {end['lost']} lost, {kills} kills, {wrong} wrong rows")
    assert (end["state"], end["done"], end["lost"], wrong) == ("done", 20_000, 0, 0)
