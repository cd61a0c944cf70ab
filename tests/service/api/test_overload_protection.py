"""Requests of one client delay no other client. Checks of scenes take linear time, run outside the event loop, wait in a queue, and
end when they take too long."""

from __future__ import annotations

import asyncio
import itertools
import json
import signal
import statistics
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Any

import httpx
import psutil
import pytest

from tests.service.http_servers import MU, PATIENCE, SMALL, InProcess, Served, eventually, new_keys
from trunnion.basics.errors import SceneError
from trunnion.scene.file_format.yaml_writer import scene_to_dict
from trunnion.scene.library.model_folders import model_file
from trunnion.scene.scene_loader import load_scene
from trunnion.service.api.transport.request_bodies import BODY_MODELS
from trunnion.service.basics.server_settings import Limits
from trunnion.service.cli.serve import END_SECONDS
from trunnion.service.request_models.job_request import SceneSource, scene_of
from trunnion.service.request_workers.fair_queue import MOST_OF_CALLER, QueueFull
from trunnion.service.request_workers.worker_processes import (
    READY,
    START_SECONDS,
    NotReady,
    ProcessEnded,
    TookTooLong,
    WorkerPool,
    WorkerProcess,
)
from trunnion.service.request_workers.worker_tasks import check_job, check_scene

MEMORY = 4e9
JSON = {"content-type": "application/json"}


def unknown_keys(n: int) -> dict[str, Any]:
    """A scene with n unknown keys."""
    scene = scene_to_dict(load_scene(model_file("spherical_pendulum")))
    next(iter(scene["bodies"].values())).update({f"masss{i}": 1 for i in range(n)})
    return {"scene": scene}


def wide_yaml(n: int) -> dict[str, Any]:
    """n wrong bodies as YAML."""
    return {"scene_text": "schema: 1\nbodies:\n" + "".join(f"  b{i}: {{mas: 1}}\n" for i in range(n))}


def work_of(body: dict[str, Any]) -> float:
    """Processor seconds of a check."""
    source, began = SceneSource.model_validate(body), time.process_time()
    with suppress(SceneError):
        scene_of(source, Limits())
    return time.process_time() - began


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("hostile", [unknown_keys, wide_yaml])
def test_a_check_takes_time_in_proportion_to_what_is_sent(hostile: Any) -> None:
    work_of(hostile(10))
    assert work_of(hostile(4000)) < 8.0 * max(work_of(hostile(1000)), 0.02)  # 4 is measured; a quadratic check would give 16


def test_text_and_values_of_a_scene_have_limits() -> None:
    with pytest.raises(ValueError, match="at most"):
        SceneSource.model_validate({"scene_text": " " * 400_000})
    with pytest.raises(SceneError, match="values"):
        scene_of(SceneSource.model_validate({"scene": {"bodies": {f"b{i}": {} for i in range(150_000)}}}), Limits())


def test_no_long_body_is_read_by_the_server_itself(server: InProcess) -> None:
    """A million values where a few tags are expected must not delay other clients."""
    document, alone = server.get("/openapi.json").json(), list[str]()
    for path, methods in document["paths"].items():
        for method, operation in methods.items():
            schema = operation.get("requestBody", {}).get("content", {}).get("application/json", {}).get("schema")
            if schema and schema.get("$ref", "").rpartition("/")[2] not in BODY_MODELS:
                alone.append(path)
                body = b'{"tags": [' + b"1," * 10_000 + b"1]}"
                answer = server.client.request(method, path.format(job="0" * 24), content=body, headers=JSON)
                assert (path, answer.status_code) == (path, 413)
    assert alone


def asked(pool: WorkerPool, *calls: Any) -> list[Any]:
    """Results of several requests to a pool, all sent at once."""

    async def all_of_them() -> list[Any]:
        return await asyncio.gather(*(pool.ask(*c, seconds=5.0) for c in calls), return_exceptions=True)

    return asyncio.run(all_of_them())


class Told(WorkerProcess):
    """A worker without a process. It records the requests that it served."""

    served: list[str]

    def start(self) -> None:
        """Do nothing: this worker has no process."""

    def run_task(self, name: Any, arguments: tuple[Any, ...], seconds: float) -> Any:
        """Record the request."""
        time.sleep(0.005)
        self.served.append(name)


@pytest.mark.parametrize("workers", [1, 2])
def test_callers_take_turns_however_many_requests_each_has_sent(workers: int) -> None:
    pool, served = WorkerPool(workers, MEMORY), list[str]()
    for i in range(workers):
        pool.workers[i] = Told(0)
        pool.workers[i].served = served  # type: ignore[attr-defined]
    pool.free = list(pool.workers)
    asked(pool, *[("greedy", "greedy")] * 40, *[(f"other {i}", f"other {i}") for i in range(5)])
    assert len(served) == 45
    assert max(served.index(f"other {i}") for i in range(5)) < 15
    ends = asked(pool, *[("greedy", "greedy")] * (MOST_OF_CALLER + 9))
    assert sum(isinstance(e, QueueFull) and e.own for e in ends) == 8
    asked(pool, *[("many", "many")] * 20, *[("as many", "as many")] * 20, ("one", "one"))
    served = served[-41:]
    assert served.index("one") < 10
    assert abs(served[:20].count("many") - served[:20].count("as many")) <= 4
    assert (pool.busy, pool.waiting, len(pool.free)) == ({}, {}, workers)


def test_a_worker_that_takes_too_long_or_has_died_is_replaced() -> None:
    worker, limits = WorkerProcess(int(MEMORY)), Limits()
    right = (b'{"scene": "spherical_pendulum"}', "application/json", limits)
    assert b"spherical_pendulum" in worker.run_task(check_scene, right, PATIENCE)[0]
    long = json.dumps(wide_yaml(8000)).encode(), "application/json", limits
    with pytest.raises(TookTooLong):
        worker.run_task(check_scene, long, 0.1)
    assert not worker.process.is_alive()
    assert b"spherical_pendulum" in worker.run_task(check_scene, right, PATIENCE)[0]
    with ThreadPoolExecutor(1) as pool:
        waiting = pool.submit(worker.run_task, check_scene, long, PATIENCE)
        time.sleep(0.3)
        worker.end()
        assert isinstance(waiting.exception(), ProcessEnded)
    worker.end()


class Slow(WorkerProcess):
    """A worker without a process. seconds: times until its answers arrive, s."""

    def __init__(self, *seconds: float):
        super().__init__(0)
        self.seconds, self.answers = list(seconds), [READY, (True, "answer", [])]

    def start(self) -> None:
        """Begin to start: the connection exists from now on."""
        self.connection = self

    def poll(self, seconds: float) -> bool:
        """True if the next answer comes within the given time."""
        return self.seconds.pop(0) < seconds

    def send(self, request: Any) -> None:
        """Take a request."""

    def recv(self) -> Any:
        """The next answer."""
        return self.answers.pop(0)


def test_the_time_in_which_a_worker_starts_is_not_the_requests() -> None:
    """A request may take the time of the limit after the worker has started. The start of a worker on a busy machine does not
    count."""
    assert Slow(0.9 * START_SECONDS, 0.1).run_task(check_scene, (), 0.2) == ("answer", [])
    with pytest.raises(TookTooLong):
        Slow(0.1, 0.3).run_task(check_scene, (), 0.2)
    with pytest.raises(NotReady):
        Slow(1.1 * START_SECONDS).run_task(check_scene, (), 9.0)


@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited on Linux only")
def test_a_worker_gets_no_more_memory_than_its_limit() -> None:
    worker, limits = WorkerProcess(1_500_000_000), Limits(cases=10**9, output_bytes=10**12)
    over = {"simulation.until": "1:2:1000000", MU: "0.1:0.6:200"}  # the list of end times would take 3 GB
    for asked, ends in (({"scene": "spherical_pendulum", "vary": over}, ProcessEnded), ({"scene": "no_such_model"}, SceneError)):
        with pytest.raises(ends):
            worker.run_task(check_job, (json.dumps(asked).encode(), "application/json", limits), PATIENCE)
    assert worker.process.is_alive()
    worker.end()


def crowd(url: str, key: str, stop: threading.Event, clients: int, answers: list[int]) -> list[threading.Thread]:
    """Clients with a key send hostile checks until the test stops them. answers: status of each answer as it arrives."""
    body, headers = json.dumps(wide_yaml(9000)).encode(), {"X-API-Key": key, "Content-Type": "application/json"}

    def ask() -> None:
        with httpx.Client(base_url=url, timeout=None, headers=headers) as c, suppress(httpx.HTTPError):
            while not stop.is_set():
                answers.append(c.post("/v1/scenes/check", content=body).status_code)

    threads = [threading.Thread(target=ask, daemon=True) for _ in range(clients)]
    for t in threads:
        t.start()
    return threads


@pytest.mark.slow
def test_under_hostile_checks_the_others_are_served_and_the_server_ends_in_five_seconds(tmp_path: Path) -> None:
    assert END_SECONDS < 5.0  # after this time, a timer ends the process
    with Served(tmp_path / "data", "--workers", "1", "--keys") as s:
        reader, own = new_keys(s, "read", "submit")
        s.client.headers["X-API-Key"] = own
        job, stop = s.submit(SMALL | {"vary": {MU: "0.1:0.6:400"}, "until": 400.0}), threading.Event()
        answers: list[int] = []
        threads = crowd(str(s.client.base_url), reader, stop, 12, answers)
        with ThreadPoolExecutor(1) as pool:  # this client follows the job and keeps its connection
            follower = httpx.Client(base_url=s.client.base_url, timeout=None, headers={"X-API-Key": own})
            following = pool.submit(follower.get, f"/v1/jobs/{job}/events")
            ready, before = [], []
            for _ in range(30):
                before.append(len(answers))
                ready.append(s.get("/readyz").status_code)
            # a client that waits for its turn only once sees at most two of these answers; a client behind all other clients sees
            # twelve
            assert statistics.median(after - count for count, after in itertools.pairwise(before)) <= 2
            # the server serves this check before the checks of the twelve other clients
            assert s.post("/v1/scenes/check", {"scene": "spherical_pendulum"}).status_code == 200
            assert set(ready) <= {200, 503}
            assert s.job(job)["state"] in ("queued", "running")
            assert s.process is not None
            workers = psutil.Process(s.process.pid).children(recursive=True)
            s.process.send_signal(signal.SIGTERM)
            assert s.process.wait(PATIENCE) in (0, -signal.SIGTERM)
            stop.set()
            following.exception()
        s.process = None
        eventually(lambda: not [p for p in workers if p.is_running() and p.status() != psutil.STATUS_ZOMBIE])
        for t in threads:
            t.join()
        assert set(answers) <= {422, 429, 503}
