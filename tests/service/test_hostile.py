"""What one client sends holds up nobody: checks are linear, leave the event loop, wait their turn, and end when they take too
long."""

from __future__ import annotations

import asyncio
import json
import multiprocessing
import signal
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

from engine.basics.problems import SceneError
from engine.scene.dump import scene_to_dict
from engine.scene.library import model_file
from engine.scene.load import load_scene
from service.api.bodies import MODELS
from service.desk import clerk as clerks
from service.desk.clerk import READY, Clerk, Ended, NotReady, TookTooLong
from service.desk.desk import Desk
from service.desk.row import MOST_OF_ONE, Crowded
from service.request import SceneSource, scene_of
from service.settings import Limits
from tests.service.serving import MU, SMALL, InProcess, Served, eventually, new_keys

MEMORY = 4e9
JSON = {"content-type": "application/json"}


def unknown_keys(n: int) -> dict[str, Any]:
    """A scene with n keys nobody knows."""
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


@pytest.mark.parametrize("hostile", [unknown_keys, wide_yaml])
def test_a_check_takes_time_in_proportion_to_what_is_sent(hostile: Any) -> None:
    work_of(hostile(10))
    assert work_of(hostile(4000)) < 8.0 * max(work_of(hostile(1000)), 0.02)  # quadratic: 16; measured: 4


def test_text_and_values_of_a_scene_have_limits() -> None:
    with pytest.raises(ValueError, match="at most"):
        SceneSource.model_validate({"scene_text": " " * 400_000})
    with pytest.raises(SceneError, match="values"):
        scene_of(SceneSource.model_validate({"scene": {"bodies": {f"b{i}": {} for i in range(150_000)}}}), Limits())


def test_no_long_body_is_read_by_the_server_itself(server: InProcess) -> None:
    """A million values where a few tags are expected held up everybody for half a second."""
    document, alone = server.get("/openapi.json").json(), list[str]()
    for path, methods in document["paths"].items():
        for method, operation in methods.items():
            schema = operation.get("requestBody", {}).get("content", {}).get("application/json", {}).get("schema")
            if schema and schema.get("$ref", "").rpartition("/")[2] not in MODELS:
                alone.append(path)
                body = b'{"tags": [' + b"1," * 10_000 + b"1]}"
                answer = server.client.request(method, path.format(job="0" * 24), content=body, headers=JSON)
                assert (path, answer.status_code) == (path, 413)
    assert alone


def asked(desk: Desk, *calls: Any) -> list[Any]:
    """What becomes of several requests at a desk, all sent at once."""

    async def all_of_them() -> list[Any]:
        return await asyncio.gather(*(desk.ask(*c, seconds=5.0) for c in calls), return_exceptions=True)

    return asyncio.run(all_of_them())


class Told(Clerk):
    """A clerk without a process, who notes whom it served."""

    served: list[str]

    def start(self) -> None:
        """There is nothing to start."""

    def ask(self, name: str, arguments: tuple[Any, ...], seconds: float) -> Any:
        """Note it."""
        time.sleep(0.005)
        self.served.append(name)


@pytest.mark.parametrize("clerks", [1, 2])
def test_callers_take_turns_however_many_requests_each_has_sent(clerks: int) -> None:
    desk, served = Desk(clerks, MEMORY), list[str]()
    for i in range(clerks):
        desk.clerks[i] = Told(0)
        desk.clerks[i].served = served  # type: ignore[attr-defined]
    desk.free = list(desk.clerks)
    asked(desk, *[("greedy", "greedy")] * 40, *[(f"other {i}", f"other {i}") for i in range(5)])
    assert len(served) == 45
    assert max(served.index(f"other {i}") for i in range(5)) < 15
    ends = asked(desk, *[("greedy", "greedy")] * (MOST_OF_ONE + 9))
    assert sum(isinstance(e, Crowded) and e.own for e in ends) == 8
    asked(desk, *[("many", "many")] * 20, *[("as many", "as many")] * 20, ("one", "one"))
    served = served[-41:]
    assert served.index("one") < 10
    assert abs(served[:20].count("many") - served[:20].count("as many")) <= 4
    assert (desk.busy, desk.waiting, len(desk.free)) == ({}, {}, clerks)


def test_a_clerk_that_takes_too_long_or_has_died_is_replaced() -> None:
    clerk, limits = Clerk(int(MEMORY)), Limits()
    right = (b'{"scene": "spherical_pendulum"}', "application/json", limits)
    assert b"spherical_pendulum" in clerk.ask("check_scene", right, 30.0)
    long = json.dumps(wide_yaml(8000)).encode(), "application/json", limits
    with pytest.raises(TookTooLong):
        clerk.ask("check_scene", long, 0.1)
    assert not clerk.process.is_alive()
    assert b"spherical_pendulum" in clerk.ask("check_scene", right, 30.0)
    with ThreadPoolExecutor(1) as pool:
        waiting = pool.submit(clerk.ask, "check_scene", long, 60.0)
        time.sleep(0.3)
        clerk.end()
        assert isinstance(waiting.exception(), Ended)
    clerk.end()


class Slow(Clerk):
    """A clerk that is ready after a while, on a thread instead of a process, and then answers at once."""

    def start(self) -> None:
        """Begin to start."""
        self.connection, theirs = multiprocessing.Pipe()

        def started() -> None:
            time.sleep(0.3)
            with suppress(OSError):  # nobody waits any more
                theirs.send(READY)
                theirs.send((True, theirs.recv()[0]))

        threading.Thread(target=started, daemon=True).start()


def test_the_time_in_which_a_clerk_starts_is_not_the_requests(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a busy machine the first request was told to ask for less."""
    assert Slow(0).ask("check_scene", (), 0.2) == "check_scene"
    monkeypatch.setattr(clerks, "STARTING", 0.1)
    with pytest.raises(NotReady):
        Slow(0).ask("check_scene", (), 9.0)


@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited on Linux only")
def test_a_clerk_gets_no_more_memory_than_its_limit() -> None:
    clerk, limits = Clerk(1_500_000_000), Limits(cases=10**9, output_bytes=10**12)
    over = {"simulation.until": "1:2:1000000", MU: "0.1:0.6:200"}  # its times are 3 GB
    for asked, ends in (({"scene": "spherical_pendulum", "over": over}, Ended), ({"scene": "spherical_pendulum"}, SceneError)):
        with pytest.raises(ends):
            clerk.ask("check_job", (json.dumps(asked).encode(), "application/json", limits), 60.0)
    assert clerk.process.is_alive()
    clerk.end()


def crowd(url: str, key: str, stop: threading.Event, clients: int) -> list[threading.Thread]:
    """Clients with a key that send hostile checks until they are told to stop."""
    body, headers = json.dumps(wide_yaml(9000)).encode(), {"X-API-Key": key, "Content-Type": "application/json"}

    def ask() -> None:
        with httpx.Client(base_url=url, timeout=60, headers=headers) as c, suppress(httpx.HTTPError):
            while not stop.is_set():
                assert c.post("/v1/scenes/check", content=body).status_code in (422, 429, 503)

    threads = [threading.Thread(target=ask, daemon=True) for _ in range(clients)]
    for t in threads:
        t.start()
    return threads


def test_under_hostile_checks_the_others_are_served_and_the_server_ends_in_five_seconds(tmp_path: Path) -> None:
    with Served(tmp_path / "data", "--workers", "1", "--keys") as s:
        reader, own = new_keys(s, "read", "submit")
        s.client.headers["X-API-Key"] = own
        job, stop = s.submit(SMALL | {"over": {MU: "0.1:0.6:400"}, "until": 400.0}), threading.Event()
        threads = crowd(str(s.client.base_url), reader, stop, 12)
        with ThreadPoolExecutor(1) as pool:  # one who follows the job, and never lets go
            follower = httpx.Client(base_url=s.client.base_url, timeout=60, headers={"X-API-Key": own})
            following = pool.submit(follower.get, f"/v1/jobs/{job}/events")
            ready = [s.get("/readyz", timeout=2.0).status_code for _ in range(30)]
            assert s.post("/v1/scenes/check", {"scene": "spherical_pendulum"}).status_code == 200  # not after twelve others
            assert set(ready) <= {200, 503}
            assert s.job(job)["state"] in ("queued", "running")
            assert s.process is not None
            workers = psutil.Process(s.process.pid).children(recursive=True)
            s.process.send_signal(signal.SIGTERM)
            assert s.process.wait(5) in (0, -signal.SIGTERM)  # s: the promise
            stop.set()
            following.exception()
        s.process = None
        eventually(lambda: not [p for p in workers if p.is_running() and p.status() != psutil.STATUS_ZOMBIE])
        for t in threads:
            t.join()
