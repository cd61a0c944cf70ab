"""Properties that hold for any behaviour of a client or the clock: leases, streams, slow senders, frames, owners, wrong keys,
messages."""

from __future__ import annotations

import http.client
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

import httpx
import pytest
from alembic import command
from sqlalchemy import update

import trunnion
from tests.service.api.test_keys_and_roles import with_key
from tests.service.http_servers import PATIENCE, ROOT, SMALL, InProcess, Served, unstarted
from tests.service.store.single_chunks import chunk_done, chunk_lost, cut
from tests.service.store.test_store_contract import ME, OTHER, taken
from trunnion.basics.errors import SceneError
from trunnion.service.api.routes import jobs
from trunnion.service.api.server_state.server_components import create_service
from trunnion.service.api.transport import guard_middleware
from trunnion.service.api.transport.api_keys_and_rates import new_key
from trunnion.service.basics.server_settings import Limits, Settings
from trunnion.service.store import leases_and_chunks
from trunnion.service.store.database_connection import alembic_config, transaction
from trunnion.service.store.leases_and_chunks import ChunkReport, WorkStore
from trunnion.service.store.table_definitions import jobs as table

HOUR = 3600.0


@pytest.fixture
def store(database_url: str) -> Iterator[WorkStore]:
    s = WorkStore(database_url)
    s.upgrade()
    yield s
    s.close()


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("shift", [-HOUR, HOUR])
def test_a_clock_that_is_set_strands_no_job_after_a_crash(store: WorkStore, monkeypatch: pytest.MonkeyPatch, shift: float) -> None:
    job = taken(store)
    store.claim(ME, 0.2)
    now = store.now
    monkeypatch.setattr(store, "now", lambda c: now(c) + shift)
    store.claim(OTHER, 60.0)
    time.sleep(0.3)
    assert [j.id for j in store.claim(OTHER, 60.0)] == [job.id]


def test_a_server_that_renews_keeps_its_lease_for_any_clock(
    store: WorkStore, database_url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    job, clock, steady, other = taken(store), store.now, [0.0], WorkStore(database_url)  # each server has its own record of leases
    monkeypatch.setattr(leases_and_chunks, "time", SimpleNamespace(monotonic=lambda: steady[0]))
    for shift in (0.0, -HOUR, -2 * HOUR):
        for s in (store, other):
            monkeypatch.setattr(s, "now", lambda c, shift=shift: clock(c) + shift)
        steady[0] += 40.0  # two of these steps are longer than a lease
        assert [j.id for j in store.claim(ME, 60.0)] == [job.id]
        assert other.claim(OTHER, 60.0) == []
    other.close()


def test_a_retry_is_not_put_off_by_a_clock_that_was_set_back(store: WorkStore, monkeypatch: pytest.MonkeyPatch) -> None:
    job, clock = taken(store, 10), store.now
    cut(store, ME, job.id, 10)
    chunk_lost(store, ME, job.id, 0, "error", 5, 2.0)
    assert cut(store, ME, job.id, 10) is None
    monkeypatch.setattr(store, "now", lambda c: clock(c) - HOUR)
    assert cut(store, ME, job.id, 10) is not None


def test_a_clock_that_was_set_back_leaves_the_pace_as_it_is(store: WorkStore, monkeypatch: pytest.MonkeyPatch) -> None:
    job, clock = taken(store, 30), store.now
    paces = []
    for shift in (0.0, -HOUR, -HOUR):
        monkeypatch.setattr(store, "now", lambda c, s=shift: clock(c) + s)
        chunk = cut(store, ME, job.id, 10)
        assert chunk is not None
        chunk_done(store, ME, job.id, chunk.start, ChunkReport({"done": 10}, 0.1, 0.0, 1))
        now = store.job(job.id)
        assert now is not None
        paces.append(now.pace)
    assert paces[0] == paces[1] > 0.0
    assert 0.0 < paces[2] < 60.0


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[InProcess, dict[str, str]]]:
    """A server that requires keys, and its keys."""
    with unstarted(Settings(tmp_path_factory.mktemp("guarded"), host="0.0.0.0")) as s:
        found = {}
        for name, role in (("read", "read"), ("mine", "submit"), ("yours", "submit"), ("admin", "admin")):
            key, found[name] = new_key(name, role)
            s.service.store.add_key(key)
        yield s, found


def test_a_job_is_cancelled_by_its_owner_or_an_administrator_only(guarded: tuple[InProcess, dict[str, str]]) -> None:
    s, keys = guarded
    for who in ("mine", "admin"):
        job = s.submit(SMALL, **with_key(keys["mine"]))
        refused = s.client.delete(f"/v1/jobs/{job}", **with_key(keys["yours"]))
        assert (refused.status_code, s.get(f"/v1/jobs/{job}", **with_key(keys["yours"])).json()["state"]) == (403, "queued")
        assert s.client.delete(f"/v1/jobs/{job}", **with_key(keys[who])).json()["state"] == "cancelled"


def test_clients_with_wrong_keys_must_wait_and_those_with_right_keys_need_not(guarded: tuple[InProcess, dict[str, str]]) -> None:
    s, keys = guarded
    answers = [s.get("/v1/jobs", **with_key(f"tr_{i:012d}_x")) for i in range(40)]
    assert {answers[0].status_code, answers[-1].status_code} == {401, 429}
    assert int(answers[-1].headers["retry-after"]) <= 60
    assert s.get("/v1/jobs", **with_key(keys["read"])).status_code == 200


def test_one_client_cannot_hold_all_streams(server: InProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    job = server.submit(SMALL | {"until": 0.01})
    server.ended(job)
    monkeypatch.setitem(server.service.streams, "local", jobs.STREAMS_OF_ONE)
    assert server.get(f"/v1/jobs/{job}/events").status_code == 429
    monkeypatch.setitem(server.service.streams, "local", 0)
    assert server.get(f"/v1/jobs/{job}/events").status_code == 200
    assert server.service.streams["local"] == 0


def test_an_fmu_that_takes_too_long_is_given_up_and_leaves_nothing_behind(tmp_path: Path) -> None:
    with unstarted(Settings(tmp_path, limits=Limits(answer_seconds=0.2))) as s:
        answer = s.post("/v1/fmus", {"scene": "spherical_pendulum"})
        assert answer.status_code == 422
        assert "longer than the 0.2 s" in answer.json()["problems"][0]["what"]
        assert not list(tmp_path.glob("fmu-*"))
        assert not any(c.process.is_alive() for c in s.service.exports.workers if c.process)


def test_the_page_is_framed_by_nobody_and_the_rest_by_the_page_only(server: InProcess) -> None:
    page, other = server.get("/"), server.get("/v1/models")
    assert (page.headers["x-frame-options"], other.headers["x-frame-options"]) == ("DENY", "SAMEORIGIN")
    assert "frame-ancestors 'none'" in page.headers["content-security-policy"]
    assert other.headers["content-security-policy"] == "frame-ancestors 'self'"


def test_a_refused_method_names_the_allowed_ones_and_head_is_answered(server: InProcess) -> None:
    answer = server.client.put("/v1/jobs")
    assert (answer.status_code, answer.headers["allow"]) == (405, "GET, HEAD, POST")
    for path in ("/", "/v1/models", "/healthz", "/readyz", "/openapi.json", "/v1/jobs"):
        head, got = server.client.head(path), server.get(path)
        assert (head.content, head.headers["content-type"]) == (b"", got.headers["content-type"])
        assert head.status_code == 200 or (path, head.status_code) == ("/readyz", 503)  # a cluster may be late on a busy machine
    assert server.client.head("/v1/jobs/none").status_code == 404
    job = server.submit(SMALL | {"until": 0.02})
    server.ended(job)
    for place in ("results", "events"):
        assert server.client.head(f"/v1/jobs/{job}/{place}").status_code == 200


def test_every_refusal_has_a_title_of_its_own() -> None:
    from trunnion.service.api.documents.problem_documents import title_of

    titles = [title_of(s) for s in (400, 401, 403, 404, 405, 406, 408, 409, 411, 413, 414, 415, 417, 422, 429, 431, 500, 501, 503)]
    assert len(set(titles)) == len(titles)
    assert "Error" not in titles


@pytest.mark.slow
def test_a_folder_that_cannot_be_written_is_named_not_trunnion(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for settings, where in (
        (Settings(tmp_path / "file" / "data"), "--data"),
        (Settings(tmp_path / "data", results=str(tmp_path / "file" / "results")), "--results"),
    ):
        with pytest.raises(SceneError) as e:
            create_service(settings)
        assert e.value.problems[0].where == where
        assert "cannot be written" in e.value.problems[0].what
    words = [sys.executable, "-m", "trunnion", "serve", "--data", str(tmp_path / "file" / "data")]
    done = subprocess.run(words, capture_output=True, text=True, cwd=ROOT, check=False)
    assert (done.returncode, "report" in done.stderr) == (2, False)


def test_tables_of_a_newer_version_are_reported_as_such(store: WorkStore) -> None:
    with transaction(store.engine, writing=True) as c:
        c.exec_driver_sql("UPDATE alembic_version SET version_num = '9999'")
    with pytest.raises(SceneError, match="newer version"):
        store.upgrade()
    with transaction(store.engine, writing=True) as c:
        command.stamp(alembic_config(c), "head", purge=True)
        c.execute(update(table).values(label=""))


def test_a_grid_with_too_many_values_is_refused() -> None:
    with pytest.raises(SceneError, match="requests 2000000 values"):
        trunnion.sweep("spherical_pendulum", {"joints.ball.friction.mu": "0:1:2000000"})


def reply(port: int, data: bytes, seconds: float) -> bytes:
    """A server's answer to some bytes. The function reads until the server closes the connection or the given time has passed."""
    with socket.create_connection(("127.0.0.1", port), seconds) as s:
        s.settimeout(seconds)
        s.sendall(data)
        got = b""
        try:
            while piece := s.recv(1000):
                got += piece
        except TimeoutError:
            pass
        return got


def test_slow_heads_and_bodies_are_refused_and_a_server_ends_when_asked(tmp_path: Path) -> None:
    hurried = (
        "import trunnion.service.server.http_connections as c, trunnion.service.api.transport.guard_middleware as d; "
        "c.HEAD_SECONDS = d.BODY_SECONDS = 0.5"
    )
    hurried += (
        "\nimport time; from trunnion.service.executor.dask_cluster import Cluster; Cluster.close = lambda self: time.sleep(600)"
    )
    (tmp_path / "sitecustomize.py").write_text(hurried.replace("import", f"import sys; sys.path.append({str(ROOT)!r})\nimport"))
    assert guard_middleware.BODY_SECONDS >= 10.0
    with Served(tmp_path / "data", "--workers", "1", paths=[str(tmp_path)]) as s:
        for late in (b"", b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX: "):
            assert reply(s.port, late, PATIENCE).startswith(b"HTTP/1.1 408")
        lines = ("POST /v1/scenes/check HTTP/1.1", "Host: 127.0.0.1", "Content-Type: application/json", "Content-Length: 100")
        assert reply(s.port, ("\r\n".join(lines) + "\r\n\r\n{").encode(), PATIENCE).startswith(b"HTTP/1.1 408")
        assert s.get("/healthz").status_code == 200
        assert s.process is not None
        s.process.send_signal(signal.SIGTERM)
        assert s.process.wait(PATIENCE) in (0, -signal.SIGTERM)  # the server also ends if a client keeps its connection


@pytest.mark.slow
def test_an_idle_connection_stays_open_for_longer_than_clients_reuse_it(served: Served) -> None:
    # httpx reuses a connection that was idle for up to 5 s; a server that closes this connection at that moment makes the next
    # request fail
    with closing(http.client.HTTPConnection("127.0.0.1", served.port, timeout=PATIENCE)) as c:
        for idle in 0.0, 1.2 * (httpx.Limits().keepalive_expiry or 0.0):
            time.sleep(idle)
            c.request("GET", "/healthz")
            assert c.getresponse().read()



@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="the system does not tell whose a connection is")
def test_a_server_without_keys_takes_connections_of_its_own_account_only(served: Served) -> None:
    import os
    import shutil

    from tests.service.executor.test_cluster_tls import NOBODY

    assert served.get("/v1/jobs").status_code == 200
    if os.geteuid() != 0 or shutil.which("setpriv") is None:
        pytest.skip("only root can take another account")
    ask = f"import urllib.request as u; print(u.urlopen('http://127.0.0.1:{served.port}/v1/jobs', timeout=300).status)"
    python = shutil.which("python3", path="/usr/bin") or "python3"
    words = ["setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups", python, "-c", ask]
    done = subprocess.run(words, capture_output=True, text=True, check=False, cwd="/")
    assert done.returncode != 0
    assert "403" in done.stderr
