"""A job uses no more time than its budget, for any number of workers. A case that never ends takes no time from other cases."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import trunnion
from tests.service.http_servers import MU, SMALL, InProcess
from trunnion.batch.plan_and_runner import Runner
from trunnion.service.api.documents.job_document import remaining_seconds
from trunnion.service.basics.server_settings import Limits, Settings
from trunnion.service.executor import chunk_and_case_runs as runs
from trunnion.service.executor.active_job import ActiveJob
from trunnion.service.executor.parquet_parts import Parts
from trunnion.service.executor.part_file_format import CaseRange, digest_of, document_bytes
from trunnion.service.request_workers.worker_tasks import plan_job
from trunnion.service.store.store_records import Chunk, Job

NEVER = {"until": 90_000.0, "every": 0.01, "kernel": "parts"}
"""A run that no machine ends within any of these budgets."""
END = "simulation.until"
MIXED = [{MU: 0.0, END: 90_000.0} if i in (2, 9) else {MU: 0.1 + i / 100, END: 0.2} for i in range(16)]
"""Cases without friction oscillate for the whole time."""


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> Iterator[InProcess]:
    """A server with two workers and short pieces, so that overruns are found soon."""
    settings = Settings(tmp_path_factory.mktemp("quick"), workers=2, chunk_seconds=0.1, limits=Limits(cpu_limit=1.5))
    with InProcess(settings) as s:
        yield s


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("budget", [0.5, 4.0])
def test_a_job_uses_no_more_time_than_its_budget_whatever_its_cases_take(quick: InProcess, budget: float) -> None:
    end = quick.ended(quick.submit(SMALL | NEVER | {"vary": {MU: "0.1:0.6:40"}, "budget": budget}))
    assert (end["state"], end["problems"][0]["where"]) == ("failed", "budget")
    used = end["stepping_seconds"] + end["build_seconds"]
    assert 0.5 * budget < used < budget + 1.0  # the job may exceed its budget by one second


@pytest.mark.slow
def test_the_other_cases_of_a_piece_come_through_when_one_never_ends(quick: InProcess) -> None:
    asked = {"scene": "spherical_pendulum", "cases": MIXED, "reductions": ["final:ball.q[1]"], "every": 0.01, "kernel": "parts"}
    end = quick.ended(quick.submit(asked))
    assert (end["state"], end["outcomes"]) == ("done", {"done": 14, "out_of_time": 2})
    alone = trunnion.sweep(**{k: v for k, v in asked.items() if k != "scene"} | {"scene": asked["scene"], "cpu_limit": 0.1})
    names = alone.table.schema.names
    rows = {r[0]: r for r in quick.rows(end["id"])}
    assert sorted(rows) == list(range(16))
    for row in alone.table.to_pylist():
        if row["outcome"] == "done":
            assert rows[row["case"]] == [row[n] for n in names]
    assert "chunk_split" in [e.kind for e in quick.service.store.events(end["id"])]


class Clocks:
    """The clocks of a worker, which a test sets."""

    def __init__(self) -> None:
        self.wall = self.processor = 0.0

    def monotonic(self) -> float:
        return self.wall

    def thread_time(self) -> float:
        return self.processor


@pytest.fixture
def clocks(monkeypatch: pytest.MonkeyPatch) -> Clocks:
    found = Clocks()
    monkeypatch.setattr(runs, "time", found)
    monkeypatch.setattr(runs, "resource", None)
    return found


def test_other_load_of_the_machine_uses_no_time_of_a_budget(clocks: Clocks, tmp_path: Path) -> None:
    monitor = runs.ChunkMonitor(Parts(str(tmp_path)), "j", 2.0, 1.0)
    assert monitor(0)
    clocks.wall, clocks.processor = 19.0, 0.9
    assert monitor(1)
    monitor.check()
    clocks.processor = 1.1
    assert not monitor(2)  # the limit for stepping is 1 s
    monitor.check()
    clocks.processor = 2.1
    with pytest.raises(runs.OutOfTime):
        monitor.check()


def test_a_chunk_that_only_waits_ends_in_the_end(clocks: Clocks, tmp_path: Path) -> None:
    monitor = runs.ChunkMonitor(Parts(str(tmp_path)), "j", 2.0)
    clocks.wall = 20.1
    assert not monitor(0)
    with pytest.raises(runs.OutOfTime):
        monitor.check()


def test_the_times_of_a_chunk_are_those_of_the_processor(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A chunk whose building waited for a minute on the clock."""
    document = json.loads(plan_job(json.dumps(SMALL).encode(), "application/json", Limits())["document"])
    parts, data = Parts(str(tmp_path)), document_bytes(document)
    parts.write(parts.job_file("j"), data)
    monkeypatch.setattr(Runner, "build_seconds", property(lambda runner: 60.0 if runner.loops else 0.0))
    began = runs.processor_seconds()
    told = runs.run_chunk(str(tmp_path), CaseRange("j", digest_of(data), 0, 4), 600.0)
    used = runs.processor_seconds() - began
    assert told["counts"] == {"done": 4}
    assert 0.0 < told["seconds"] + told["build_seconds"] <= used


def test_granted_times_never_sum_to_more_than_the_budget() -> None:
    active = ActiveJob(a_job(budget=5.0, cases=1000), warm=True, cost=0.5)
    for start in range(100):
        seconds, _ = active.time_grant(Chunk("j", start, start + 1 + start % 3, "running", 1, 0.0, ""), 2.0, 2)
        active.granted[start] = max(0.0, seconds)
    assert active.left >= -1e-9
    assert sum(active.granted.values()) <= 5.0 + 1e-9


def test_the_time_to_go_follows_the_pace_and_grows_while_nothing_comes() -> None:
    job = a_job(cases=100, done=60, pace=0.5, landed=1000.0)
    assert remaining_seconds(job, 1000.0) == 20.0
    assert remaining_seconds(job, 1300.0) == 300.0
    assert remaining_seconds(a_job(cases=100), 1000.0) is None


def test_no_request_gets_more_for_a_case_than_the_server_gives(quick: InProcess) -> None:
    answer = quick.post("/v1/jobs/check", SMALL | {"cpu_limit": "1 min", "max_steps": 1e9})
    assert {p["where"] for p in answer.json()["problems"]} == {"cpu_limit", "max_steps"}
    sneaked = quick.post("/v1/jobs/check", {"scene": "spherical_pendulum", "cases": [{"simulation.until": 1e9}]})
    assert sneaked.json()["problems"][0]["where"] == "simulation.until"
    kept = quick.get(f"/v1/jobs/{quick.submit(SMALL | {'until': 0.01})}/request").json()
    assert (kept["cpu_limit"], kept["max_steps"]) == (1.5, Limits().max_steps)


def a_job(**more: Any) -> Job:
    """A job in the form in which the store holds it."""
    plain: dict[str, Any] = dict.fromkeys(Job.__dataclass_fields__, 0)
    return Job(**plain | {"counts": {}, "problems": [], "landed": None, "state": "running", "budget": 60.0} | more)
