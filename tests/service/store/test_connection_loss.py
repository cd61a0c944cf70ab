"""A connection to the database may break after a write command and before its confirmation. No job is left without a server, and no
result counts twice."""

from __future__ import annotations

from typing import Any

import pytest

from tests.service.http_servers import SMALL, InProcess, eventually
from trunnion.service.store.database_connection import Unreachable


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("write", ["claim", "cut_chunks", "record_outcomes", "record_last_outcomes"])
def test_a_job_continues_after_an_unconfirmed_write(
    server: InProcess, monkeypatch: pytest.MonkeyPatch, write: str
) -> None:
    store, whole, broken = server.service.store, getattr(server.service.store, write), list[str]()

    def breaks_once(*given: Any, **more: Any) -> Any:
        found = whole(*given, **more)
        if not broken:
            broken.append(write)
            raise Unreachable("the connection broke while the answer came")
        return found

    monkeypatch.setattr(store, write, breaks_once)
    job = server.submit(SMALL)
    server.ended(job)
    assert eventually(lambda: broken)  # the server claims every few seconds, also after a short job
    end = server.job(job)
    assert (end["state"], end["done"], end["lost"], end["outcomes"]) == ("done", 40, 0, {"done": 40})
    assert [r[0] for r in server.rows(end["id"])] == list(range(40))
