"""Servers for tests: one server inside this process, and one server as users run it."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import psutil

from trunnion.service.api.server_state.server_components import Service, create_service
from trunnion.service.api.transport.api_keys_and_rates import new_key
from trunnion.service.basics.engine_version import engine_version
from trunnion.service.basics.server_settings import Limits, Settings
from trunnion.service.executor.part_versions import computed_by, shaped, with_version
from trunnion.service.server.application import build_application
from trunnion.service.store.job_store import Store

ROOT = Path(__file__).resolve().parents[2]
PATIENCE = 600.0
"""Seconds to wait for an event that must happen; only a failing test waits so long."""
LONG_LIMITS = {"check_seconds": 600.0, "answer_seconds": 3600.0}
"""Time limits that no request reaches on a busy machine; a test of such a limit sets its own."""
MU = "joints.ball.friction.mu"
SMALL: dict[str, Any] = {
    "scene": "spherical_pendulum",
    "vary": {MU: "0.1:0.6:40"},
    "reductions": ["max:ball.contact[1].normal_force", "first:reversal"],
    "until": 0.5,
}


def as_stored(table: Any) -> Any:
    """The table of a sweep as a server stores it: with the version that computed each row."""
    return shaped(computed_by(table, engine_version()), with_version(table.schema))


def eventually(what: Callable[[], Any], patience: float = PATIENCE) -> Any:
    """Call ``what`` until it returns a true value, which is returned. Fails after ``patience`` seconds. The calls become less
    frequent, because the server's answers take processor time from the awaited work."""
    end, pause = time.monotonic() + patience, 0.03
    while not (found := what()):
        assert time.monotonic() < end, "the awaited value never came"
        time.sleep(pause)
        pause = min(1.2 * pause, 0.25)
    return found


class Talk:
    """Requests to a server."""

    client: Any

    def get(self, path: str, **more: Any) -> Any:
        """Send a GET request."""
        return self.client.get(path, **more)

    def post(self, path: str, body: Any, **more: Any) -> Any:
        """Send a POST request with a JSON body."""
        return self.client.post(path, json=body, **more)

    def submit(self, body: dict[str, Any], **more: Any) -> str:
        """Submit a job and return its id."""
        answer = self.post("/v1/jobs", body, **more)
        assert answer.status_code in (200, 202), answer.text
        return str(answer.json()["id"])

    def job(self, job: str) -> dict[str, Any]:
        """The document of a job."""
        return dict(self.get(f"/v1/jobs/{job}").json())

    def ended(self, job: str, patience: float = PATIENCE) -> dict[str, Any]:
        """The document of a job once the job has ended."""
        return eventually(lambda: (d := self.job(job))["state"] in ("done", "failed", "cancelled") and d, patience)

    def rows(self, job: str) -> list[list[Any]]:
        """All rows of a job's results."""
        return list(self.get(f"/v1/jobs/{job}/results").json()["rows"])


class AppTransport(httpx.BaseTransport):
    """Sends requests to an application. The application runs in an event loop on a separate thread."""

    def __init__(self, app: Any):
        self.app, self.inner = app, httpx.ASGITransport(app, raise_app_exceptions=False)
        self.loop = asyncio.new_event_loop()
        self.thread = threading.Thread(target=self.loop.run_forever, daemon=True)
        self.thread.start()
        self.life = app.router.lifespan_context(app)

    def wait(self, work: Any) -> Any:
        """The result of a coroutine."""
        return asyncio.run_coroutine_threadsafe(work, self.loop).result()

    def handle_request(self, request: httpx.Request) -> httpx.Response:
        """The answer to a request, once it is complete."""
        body = request.read()

        async def answered() -> httpx.Response:
            sent = httpx.Request(request.method, request.url, headers=request.headers, content=body)
            answer = await self.inner.handle_async_request(sent)
            content = b"".join([piece async for piece in answer.stream])  # type: ignore[union-attr]
            return httpx.Response(answer.status_code, headers=answer.headers, stream=httpx.ByteStream(content))

        return self.wait(answered())

    def close(self) -> None:
        """Cancel the remaining tasks, and stop the event loop."""

        async def cancelled() -> None:
            left = asyncio.all_tasks() - {asyncio.current_task()}
            for task in left:
                task.cancel()
            await asyncio.gather(*left, return_exceptions=True)

        if self.thread.is_alive():
            self.wait(cancelled())
            self.loop.call_soon_threadsafe(self.loop.stop)
            self.thread.join()
            self.loop.close()


class InProcess(Talk):
    """The application, called without sockets."""

    def __init__(self, settings: Settings):
        limits, usual = settings.limits, Limits()
        long = {name: most for name, most in LONG_LIMITS.items() if getattr(limits, name) == getattr(usual, name)}
        self.service: Service = create_service(replace(settings, limits=replace(limits, **long)))
        self.app = build_application(self.service)
        self.transport = AppTransport(self.app)
        self.client = httpx.Client(transport=self.transport, base_url="http://127.0.0.1", timeout=None, follow_redirects=True)

    def __enter__(self) -> InProcess:
        self.transport.wait(self.transport.life.__aenter__())
        return self

    def __exit__(self, *error: Any) -> None:
        self.transport.wait(self.transport.life.__aexit__(*error))
        self.client.close()


@contextmanager
def unstarted(settings: Settings) -> Iterator[InProcess]:
    """The application without the work of a server's start. It has no workers, and refuses requests that need a worker."""
    s = InProcess(settings)
    try:
        yield s
    finally:
        s.client.close()
        s.service.store.close()


class Served(Talk):
    """``trunnion serve`` as a separate process."""

    def __init__(self, data: Path, *options: str, port: int = 0, paths: Sequence[str] = ()):
        self.data, self.options, self.paths = data, options, paths
        self.port = port or free_port()
        self.client = httpx.Client(base_url=f"http://127.0.0.1:{self.port}", timeout=PATIENCE)
        self.process: subprocess.Popen[bytes] | None = None

    def start(self) -> Served:
        """Start the server, and wait until it answers."""
        words = [sys.executable, "-m", "trunnion", "serve", "--data", str(self.data), "--port", str(self.port)]
        words += [word for name, most in LONG_LIMITS.items() for word in ("--limit", f"{name}={most}")]
        words += self.options
        env = dict(os.environ, PYTHONPATH=os.pathsep.join([str(ROOT), *self.paths, os.environ.get("PYTHONPATH", "")]))
        log = (self.data.parent / f"{self.data.name}.log").open("ab")
        self.process = subprocess.Popen(words, env=env, stdout=log, stderr=log, start_new_session=True)
        eventually(self._answers)
        return self

    def _answers(self) -> bool:
        assert self.process is not None
        assert self.process.poll() is None, "the server ended"
        try:
            return bool(self.client.get("/healthz").status_code == 200)
        except httpx.TransportError:
            return False

    def kill(self) -> None:
        """End the server at once (SIGKILL)."""
        assert self.process is not None
        self.process.send_signal(signal.SIGKILL)
        self.process.wait(30)
        self.process = None

    def stop(self) -> None:
        """End the server as its users do, and wait until the server has ended."""
        if self.process is not None:
            self.process.send_signal(signal.SIGTERM)
            try:
                self.process.wait(30)
            except subprocess.TimeoutExpired:
                self.kill()
        self.process = None

    def __enter__(self) -> Served:
        return self.start()

    def __exit__(self, *error: Any) -> None:
        self.stop()
        self.client.close()


def spawned(process: psutil.Process) -> bool:
    """True if a process is a helper process of Python and is still running."""
    try:
        return any(way in " ".join(process.cmdline()) for way in ("spawn_main", "multiprocessing.forkserver"))
    except psutil.Error:
        return False


def new_keys(s: Served, *roles: str) -> list[str]:
    """A new key of each role, for a server that requires keys."""
    store, secrets = Store(f"sqlite:///{s.data / 'trunnion.db'}"), []
    for role in roles:
        key, secret = new_key(role, role)
        store.add_key(key)
        secrets.append(secret)
    store.close()
    return secrets


def free_port() -> int:
    """A port on which no program listens now."""
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return int(s.getsockname()[1])
