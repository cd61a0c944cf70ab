"""The cluster behind a server answers only its own server. It answers neither another account of the machine nor a program with a
foreign certificate."""

from __future__ import annotations

import asyncio
import json
import os
import shutil
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import psutil
import pytest
from distributed import Client
from distributed.core import connect, rpc
from distributed.security import Security

from tests.service.http_servers import MU, PATIENCE, ROOT, SMALL, Served, eventually, free_port
from trunnion.basics.errors import SceneError
from trunnion.service.cli.serve import certificates_of

NOBODY = 65534
TRIES = textwrap.dedent("""
    import json, os, socket, ssl, sys, urllib.error, urllib.request
    ports, api, folder = json.loads(sys.argv[1])
    told = {}
    for port in ports:
        for how in ("plain", "tls"):
            got = b""
            try:
                s = socket.create_connection(("127.0.0.1", port), 2)
                s.settimeout(2)
                if how == "tls":
                    context = ssl._create_unverified_context()
                    s = context.wrap_socket(s)
                s.sendall(b"GET /info/main/workers.html HTTP/1.1\\r\\nHost: evil.example\\r\\n\\r\\n")
                got = s.recv(100)
            except OSError as e:
                pass
            told[f"{port} {how}"] = got.decode("latin-1")
    seen = []
    for path, folders, files in os.walk(folder):
        seen += files
    try:
        api_said = urllib.request.urlopen(f"http://127.0.0.1:{api}/v1/jobs", timeout=300).status
    except urllib.error.HTTPError as e:
        api_said = e.code
    print(json.dumps([os.getuid(), told, seen, api_said]))
""")


@pytest.fixture(scope="module")
def keyed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """A server that requires keys, with one worker. Everyone may enter the folders above the server's own folder."""
    folder = tmp_path_factory.mktemp("keyed")
    for place in (folder, *folder.parents[:2]):
        place.chmod(0o755)
    with Served(folder / "data", "--workers", "1", "--keys") as s:
        eventually(lambda: s.get("/readyz").json()["workers"] == 1)
        yield s


def listening(s: Served) -> list[int]:
    """Ports on which the server and its processes listen, except the port of the API."""
    assert s.process is not None
    own = psutil.Process(s.process.pid)
    found = [c for p in (own, *own.children(recursive=True)) for c in p.net_connections("tcp") if c.status == psutil.CONN_LISTEN]
    return sorted({c.laddr.port for c in found} - {s.port})


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root can take another account")
@pytest.mark.skipif(shutil.which("setpriv") is None, reason="needs setpriv")
def test_another_account_reaches_neither_scheduler_nor_workers_nor_data(keyed: Served) -> None:
    ports = listening(keyed)
    assert len(ports) >= 2  # the scheduler and a worker listen
    asked = json.dumps([ports, keyed.port, str(keyed.data)])
    words = ["setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups", "/usr/bin/env", "-i", "PATH=/usr/bin:/bin"]
    python = shutil.which("python3", path="/usr/bin:/usr/local/bin") or sys.executable
    done = subprocess.run(
        [*words, python, "-c", TRIES, asked], capture_output=True, text=True, timeout=PATIENCE, check=False, cwd="/"
    )
    assert done.returncode == 0, done.stderr
    uid, told, seen, api = json.loads(done.stdout)
    assert (uid, api) == (NOBODY, 401)
    assert set(told.values()) == {""}, told
    assert seen == []


def test_no_port_of_the_cluster_speaks_http_or_without_the_clusters_certificate(keyed: Served) -> None:
    async def tried(address: str, **how: Any) -> str:
        try:
            there = await connect(address, timeout=3, **how)
        except OSError:
            return "refused"
        try:
            async with rpc(address, connection_args=how) as r:
                await asyncio.wait_for(r.identity(), 3)
        except (OSError, TimeoutError):
            return "refused"
        finally:
            there.abort()
        return "answered"

    other = Security.temporary().get_connection_args("client")
    for port in listening(keyed):
        assert asyncio.run(tried(f"tcp://127.0.0.1:{port}")) == "refused"
        assert asyncio.run(tried(f"tls://127.0.0.1:{port}", **other)) == "refused"


def test_the_certificates_of_a_scheduler_are_asked_for_all_at_once(tmp_path: Path) -> None:
    there = tmp_path / "ca.pem"
    there.write_text("")
    assert certificates_of("tcp://x:1", None, None, None) is None
    with pytest.raises(SceneError) as e:
        certificates_of("tcp://x:1", there, tmp_path / "none.pem", None)
    assert [p.where for p in e.value.problems] == ["--scheduler-key", "--scheduler-cert", "--scheduler"]


@contextmanager
def secured(folder: Path, port: int) -> Iterator[list[str]]:
    """A scheduler with TLS and one of its workers, as separate programs. Returns the options for a server that uses them."""
    made = Security.temporary()
    files = {"ca": made.tls_ca_file, "cert": made.tls_client_cert, "key": made.tls_client_key}
    for name, text in files.items():
        (folder / f"{name}.pem").write_text(text)
    shown = ["--tls-ca-file", "ca.pem", "--tls-cert", "cert.pem", "--tls-key", "key.pem"]
    env = dict(os.environ, PYTHONPATH=os.pathsep.join([str(ROOT), *sys.path]))
    quiet = ["--no-dashboard", "--dashboard-address", "127.0.0.1:0"]
    module, address = [sys.executable, "-m"], f"tls://127.0.0.1:{port}"
    words = [[*module, "distributed.cli.dask_scheduler", "--host", address, *shown, *quiet]]
    words += [[*module, "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-nanny", *shown, *quiet]]
    running = [subprocess.Popen(w, env=env, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) for w in words]
    try:
        options = [w for n in files for w in (f"--scheduler-{n}", str(folder / f"{n}.pem"))]
        yield ["--scheduler", address, *options]
    finally:
        for p in running:
            p.kill()
            p.wait()


@pytest.mark.slow
def test_a_scheduler_with_tls_is_used_with_its_certificates(tmp_path: Path) -> None:
    with secured(tmp_path, free_port()) as options, Served(tmp_path / "data", *options) as s:
        assert s.ended(s.submit(SMALL | {"vary": {MU: "0.1:0.6:5"}}))["state"] == "done"
        with pytest.raises((OSError, TypeError)):  # this client has no certificate
            Client(options[1], timeout=2, set_as_default=False)


@pytest.mark.slow
def test_a_scheduler_without_tls_is_warned_of(caplog: pytest.LogCaptureFixture, tmp_path: Path) -> None:
    from trunnion.service.executor.dask_cluster import Cluster

    Cluster("tcp://127.0.0.1:1", 0, tmp_path)
    assert "anyone who can connect to it can run code" in caplog.text
