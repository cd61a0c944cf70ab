"""Clients that read much delay no other client. The server reads rows of jobs in turn, and reads unchanging data only once."""

from __future__ import annotations

import asyncio
import threading
import time
from collections import Counter
from typing import Any

import pytest

from tests.service.http_servers import MU, SMALL, InProcess
from trunnion.service.api.routes import models_scenes_fmus
from trunnion.service.api.server_state.row_read_queue import READERS, ReadTurns
from trunnion.service.request_workers.fair_queue import MOST_OF_CALLER, QueueFull


def test_no_client_takes_all_places_of_readers_and_others_come_soon() -> None:
    reads, now, most, order, lock = ReadTurns(), Counter[str](), Counter[str](), list[str](), threading.Lock()

    def work(who: str) -> None:
        with lock:
            order.append(who)
            now[who] += 1
            most[who] = max(most[who], now[who])
            most["all"] = max(most["all"], now.total())
        time.sleep(0.005)
        with lock:
            now[who] -= 1

    async def all_of_them() -> None:
        await asyncio.gather(*(reads.run(who, lambda w=who: work(w)) for who in ["greedy"] * 40 + [f"other {i}" for i in range(5)]))

    asyncio.run(all_of_them())
    assert most["greedy"] == READERS - 1
    assert most["all"] <= READERS
    assert max(order.index(f"other {i}") for i in range(5)) < 20
    assert (reads.busy, reads.waiting, len(reads.free)) == ({}, {}, READERS)


def test_too_many_readers_are_refused_but_no_answer_that_has_begun() -> None:
    reads = ReadTurns()

    async def pieces(of: int) -> int:
        source = iter([b"x"] * of)
        return sum([len(p) async for p in reads.stream("a", b"x", source)])

    async def all_of_them() -> list[Any]:
        asked = [reads.run("a", lambda: time.sleep(0.01)) for _ in range(MOST_OF_CALLER + 9)]
        return await asyncio.gather(*asked, *(pieces(3) for _ in range(9)), return_exceptions=True)

    came = asyncio.run(all_of_them())
    assert sum(isinstance(e, QueueFull) and e.own for e in came) == 9 - (READERS - 1)
    assert came[-9:] == [4] * 9


@pytest.fixture(scope="module")
def job(server: InProcess) -> str:
    """A job with a crossed sample that stores rows."""
    sample = {"ranges": {MU: [0.1, 0.6]}, "count": 32, "method": "saltelli"}
    there = server.submit(SMALL | {"vary": None, "sample": sample, "trajectories": ["ball.q[1]"], "spacing": 0.1})
    server.ended(there)
    return there


@pytest.mark.parametrize(
    "path", ["results?format=json", "results?format=csv", f"bins?x={MU}", "trajectories", "indices", "spreads"]
)
def test_requests_that_read_rows_take_turns(server: InProcess, job: str, path: str, monkeypatch: pytest.MonkeyPatch) -> None:
    taken, take = [], server.service.reads.take

    async def noted(who: str, begun: bool = False) -> int:
        taken.append(who)
        return await take(who, begun)

    monkeypatch.setattr(server.service.reads, "take", noted)
    assert server.get(f"/v1/jobs/{job}/{path}").status_code == 200
    assert set(taken) == {"local"}
    assert not server.service.reads.busy


def test_bundled_models_are_read_once(server: InProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    first = server.get("/v1/models").json()
    monkeypatch.setattr(models_scenes_fmus, "load_scene", lambda _: pytest.fail("read again"))
    assert server.get("/v1/models").json() == first
    assert server.get(f"/v1/models/{first[0]['name']}").json()["title"] == first[0]["title"]
