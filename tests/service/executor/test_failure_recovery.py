"""Any process may be killed. A job then has each of its results exactly once, and equal to the result of an uninterrupted run."""

from __future__ import annotations

import os
import random
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import psutil
import pytest

import trunnion
from tests.service.http_servers import MU, ROOT, SMALL, Served, as_stored, eventually, free_port, spawned
from tests.service.page.chromium_tab import browser, until
from tests.service.postgresql_servers import DatabaseMissing, packaged

CASES = 150
LONG: dict[str, Any] = {
    "scene": "spherical_pendulum",
    "vary": {MU: f"0.1:0.6:{CASES}"},
    "reductions": ["max:ball.contact[1].normal_force", "final:ball.qd[2]", "count:reversal"],
    "until": 20.0,
}
QUICK = ("--lease", "0.6", "--chunk-seconds", "0.25")
__all__ = ["browser"]
BRIM = Path(__file__).parent / "full_disk"


def uninterrupted(request: dict[str, Any]) -> list[list[Any]]:
    """The rows of the job in an uninterrupted run."""
    t = trunnion.sweep(request["scene"], request["vary"], reductions=request["reductions"], until=request["until"]).table
    return [list(r.values()) for r in as_stored(t).to_pylist()]


@pytest.fixture(scope="module")
def expected() -> list[list[Any]]:
    """The rows of LONG in an uninterrupted run, computed once."""
    return uninterrupted(LONG)


def children(s: Served) -> list[psutil.Process]:
    """The server's worker processes."""
    assert s.process is not None
    return [p for p in psutil.Process(s.process.pid).children(recursive=True) if spawned(p)]


@pytest.mark.parametrize(("cases", "kills", "until"), [(CASES, 1, 20.0), pytest.param(1000, 5, 150.0, marks=pytest.mark.slow)])
def test_every_result_is_there_once_after_kills_of_the_server_and_of_workers_at_random(
    tmp_path: Path, expected: list[list[Any]], cases: int, kills: int, until: float
) -> None:
    chance = random.Random(8)
    asked = LONG | {"vary": {MU: f"0.1:0.6:{cases}"}, "until": until}
    with Served(tmp_path / "data", "--workers", "2", *QUICK) as s:
        job = s.submit(asked)
        for _ in range(kills):
            before = s.job(job)["done"]
            eventually(lambda b=before: s.job(job)["done"] > b + 15)
            workers = children(s)
            if chance.random() < 0.7:
                chance.choice(workers).kill()
                before = s.job(job)["done"]
                eventually(lambda b=before: s.job(job)["done"] > b)
            workers = children(s)
            assert s.job(job)["state"] == "running"
            s.kill()
            # no worker process outlives its server
            eventually(lambda w=workers: not any(p.is_running() and p.status() != psutil.STATUS_ZOMBIE for p in w))
            s.start()
        end = s.ended(job)
        assert (end["state"], end["done"], end["lost"], end["outcomes"]) == ("done", cases, 0, {"done": cases})
        assert s.rows(job) == (expected if asked == LONG else uninterrupted(asked))
        parts = [tuple(map(int, p.stem.split("-")[1:])) for p in (tmp_path / "data" / "results" / job).glob("*.parquet")]
        assert sum(stop - start for start, stop in parts) == cases, "a case was computed into two parts"


@contextmanager
def dask(port: int) -> Iterator[list[subprocess.Popen[bytes]]]:
    """A scheduler on loopback and one of its workers, as separate programs."""
    env = dict(os.environ, PYTHONPATH=str(ROOT))
    common: dict[str, Any] = {"env": env, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "start_new_session": True}
    here, quiet = ["--host", "127.0.0.1"], ["--no-dashboard", "--dashboard-address", "127.0.0.1:0"]
    words = [[sys.executable, "-m", "distributed.cli.dask_scheduler", *here, "--port", str(port), *quiet]]
    words += [
        [sys.executable, "-m", "distributed.cli.dask_worker", f"tcp://127.0.0.1:{port}", "--nthreads", "1", "--no-nanny", *quiet]
    ]
    processes = [subprocess.Popen(w, **common) for w in words]
    try:
        yield processes
    finally:
        for p in processes:
            p.kill()
            p.wait()


@pytest.mark.slow
def test_an_outside_scheduler_runs_the_same_job_also_when_it_is_restarted_on_the_way(
    tmp_path: Path, expected: list[list[Any]]
) -> None:
    port = free_port()
    with Served(tmp_path / "data", "--scheduler", f"tcp://127.0.0.1:{port}", *QUICK) as s:
        with dask(port):
            job = s.submit(LONG)
            eventually(lambda: s.job(job)["done"] > 60)
        eventually(lambda: s.get("/readyz").status_code == 503)
        assert s.job(job)["state"] == "running"
        with dask(port):
            end = s.ended(job)
            assert (end["state"], end["outcomes"]) == ("done", {"done": CASES})
            assert s.rows(job) == expected


@pytest.fixture(scope="module")
def brimming(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Served, Path]]:
    """A server and a file FULL on its disk. The disk is full for parts whose names contain a line of this file."""
    folder = tmp_path_factory.mktemp("brimming")
    results = folder / "results"
    results.mkdir()
    words = ("--workers", "1", "--results", f"brim://{results}", "--retry-delay", "0.5")
    with Served(folder / "data", *words, paths=[str(BRIM)]) as s:
        yield s, results / "FULL"


@pytest.mark.slow
def test_a_full_disk_fails_a_chunk_clearly_and_the_other_results_stand(brimming: tuple[Served, Path]) -> None:
    s, full = brimming
    full.write_text("part-000000008-\n")
    end = s.ended(s.submit(SMALL))
    assert (end["state"], end["done"] + end["lost"]) == ("failed", 40)
    assert "No space left" in end["problems"][0]["what"]
    rows = s.rows(end["id"])
    assert [r[0] for r in rows] == [i for i in range(40) if not 8 <= i < 8 + end["lost"]]
    whole = trunnion.sweep(SMALL["scene"], SMALL["vary"], reductions=SMALL["reductions"], until=SMALL["until"])
    stored = as_stored(whole.table).to_pylist()
    assert rows == [list(stored[r[0]].values()) for r in rows]
    assert len([a for a in s.get(f"/v1/jobs/{end['id']}/attempts").json() if a["start"] == 8]) == 5


@pytest.mark.slow
def test_a_disk_that_has_room_again_in_time_costs_only_retries(brimming: tuple[Served, Path]) -> None:
    s, full = brimming
    full.write_text("part-\n")
    job = s.submit(SMALL)
    eventually(lambda: s.get(f"/v1/jobs/{job}/attempts").json()[0:1] and s.get(f"/v1/jobs/{job}/attempts").json()[0]["result"])
    full.unlink()
    assert (s.ended(job)["state"], len(s.rows(job))) == ("done", 40)


@pytest.mark.slow
def test_the_page_says_that_a_disk_is_full_and_continues_when_it_is_not(brimming: tuple[Served, Path], browser: Any) -> None:
    s, full = brimming
    full.write_text("part-\n")
    job = s.submit(SMALL)
    page = browser.new_page()
    page.goto(f"http://127.0.0.1:{s.port}/jobs/{job}")
    until(page, "document.getElementById('trouble').textContent.includes('No space left')")
    full.unlink()
    until(page, "document.getElementById('state').textContent.startsWith('done: 40 of 40')")
    assert page.inner_text("#trouble") == ""
    page.close()


@pytest.mark.slow
@pytest.mark.parametrize("unwritable", ["part-", "job.json"], ids=["part", "document"])
def test_a_storage_that_fails_by_its_own_kind_of_error_is_named_and_costs_only_retries(
    brimming: tuple[Served, Path], unwritable: str
) -> None:
    s, full = brimming
    fails = full.with_name("FAILS")
    fails.write_text(f"{unwritable}\n")
    job = s.submit(SMALL)
    eventually(lambda: "PackageError: try again later" in s.get("/readyz").text + s.get(f"/v1/jobs/{job}/attempts").text)
    fails.unlink()
    assert (s.ended(job)["state"], len(s.rows(job))) == ("done", 40)
    fails.write_text("part-\n")
    answer = s.get(f"/v1/jobs/{job}/results")
    fails.unlink()
    assert (answer.status_code, answer.json()["detail"]) == (503, "the storage of the results is unavailable; try again")


@pytest.mark.slow
def test_a_database_that_goes_away_is_waited_for_and_the_job_continues(tmp_path: Path) -> None:
    import tempfile

    from tests.service.conftest import missing

    pytest.importorskip("pgserver")
    with tempfile.TemporaryDirectory(prefix="pg-") as folder:
        try:
            with packaged(Path(folder)) as url, Served(tmp_path / "data", "--workers", "1", "--database", url, *QUICK) as s:
                job = s.submit(LONG)
                eventually(lambda: s.job(job)["done"] > 50)
                stop_postgres(Path(folder))
                answer = s.get(f"/v1/jobs/{job}")
                assert (answer.status_code, answer.headers["content-type"]) == (503, "application/problem+json")
                assert "retry-after" in answer.headers
                assert s.get("/readyz").status_code == 503
                assert s.get("/healthz").status_code == 200
                start_postgres(Path(folder))
                end = s.ended(job)
                assert (end["state"], end["outcomes"]) == ("done", {"done": CASES})
                assert len(s.rows(job)) == CASES
        except DatabaseMissing as e:
            missing("postgresql", str(e))


@pytest.mark.slow
def test_a_second_server_on_the_same_database_continues_the_jobs_of_the_first(
    tmp_path: Path, postgres: str, expected: list[list[Any]]
) -> None:
    options = ("--workers", "1", "--database", postgres, "--results", str(tmp_path / "results"), *QUICK)
    with Served(tmp_path / "first", *options) as first, Served(tmp_path / "second", *options) as second:
        jobs = [(first, second)[k % 2].submit(LONG) for k in range(4)]
        eventually(lambda: sum(second.job(job)["done"] for job in jobs) > CASES)
        first.kill()
        for job in jobs:
            end = second.ended(job)
            assert (end["state"], end["lost"], end["outcomes"]) == ("done", 0, {"done": CASES})
            assert second.rows(job) == expected


def stop_postgres(folder: Path) -> None:
    """Stop the database at once, as after a power cut."""
    from pgserver import pg_ctl

    pg_ctl(["-m", "immediate", "-w", "stop"], pgdata=folder, user=None if os.geteuid() else "pgserver")


def start_postgres(folder: Path) -> None:
    """Start the database again on the same files."""
    from pgserver import pg_ctl

    options = f'-h "" -k {folder}'
    pg_ctl(["-w", "-o", options, "-l", str(folder / "log"), "start"], pgdata=folder, user=None if os.geteuid() else "pgserver")
