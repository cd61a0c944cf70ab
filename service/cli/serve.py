"""``trunnion serve``."""

from __future__ import annotations

import errno
import gc
import logging
import os
import socket
import sys
import threading
from pathlib import Path
from typing import Annotated, Any

import typer

from trunnion.basics.optional_packages import absent
from trunnion.basics.problems import Problem, SceneError, SimulationError
from trunnion.service.basics.server_settings import Settings
from trunnion.service.cli.serve_options import (
    CaFile,
    CertFile,
    Data,
    Database,
    Host,
    Keep,
    KeyFile,
    LimitWords,
    NewKey,
    Results,
    Scheduler,
    Webhooks,
    certificates_of,
    kept_for,
    limits_of,
)

GRACE_SECONDS, END_SECONDS = 2, 4.0
"""Limits of time, s, after the signal to end: for requests in progress, and until the process ends."""
KEEP_ALIVE_SECONDS = 75
"""Time for which an idle connection stays open, s. The time is longer than that of clients (httpx 5 s, nginx 60 s), so that the
client closes the connection first. If the server closed first, a request sent at the same moment would fail."""
BACKLOG = 2048
"""Number of connections that may wait to be accepted (uvicorn's default)."""
SWITCH_SECONDS = 0.0005
"""Longest time, s, for which a thread that formats rows blocks the other threads. With Python's default of 5 ms, such a thread
could delay a request by 5 ms about ten times."""


def command(
    data: Data = Path("trunnion-data"),
    host: Host = "127.0.0.1",
    port: Annotated[
        int, typer.Option(metavar="PORT", min=0, max=65535, help="Port at which the server listens; 0: any free port.")
    ] = 8765,
    database: Database = "",
    results: Results = "",
    scheduler: Scheduler = "",
    scheduler_ca: CaFile = None,
    scheduler_cert: CertFile = None,
    scheduler_key: KeyFile = None,
    workers: Annotated[
        int, typer.Option(metavar="N", min=0, help="Number of worker processes, without --scheduler.", show_default="one per core")
    ] = 0,
    keys: Annotated[bool, typer.Option("--keys", help="Require API keys also for requests from this machine.")] = False,
    rate: Annotated[
        str, typer.Option(metavar="RATE", help="Limit of the requests with one key, such as 1200/minute.", show_default="no limit")
    ] = "",
    *,
    limit: LimitWords,
    keep: Keep = "",
    webhook: Webhooks,
    new_key: NewKey = "",
    lease: Annotated[float, typer.Option(hidden=True, min=0.3)] = 6.0,
    retry_delay: Annotated[float, typer.Option(hidden=True, min=0.0)] = 2.0,
    chunk_seconds: Annotated[float, typer.Option(hidden=True, min=0.01)] = 2.0,
) -> int:
    """Serve simulations and sweeps over HTTP, with a web page."""
    if problems := absent("service", "trunnion serve"):
        raise SceneError(problems)
    from trunnion.service.store.database_connection import Unreachable

    limits, certificates = limits_of(rate, limit), certificates_of(scheduler, scheduler_ca, scheduler_cert, scheduler_key)
    settings = Settings(
        data, host, port, database, results, scheduler, workers, certificates, keys, limits, chunk_seconds,
        retry_delay=retry_delay, lease=lease, keep=kept_for(keep), webhooks=tuple(webhook),
        webhook_secret=os.environ.get("TRUNNION_WEBHOOK_SECRET", ""),
    )  # fmt: skip
    try:
        return make_key(settings, new_key) if new_key else run_server(settings)
    except Unreachable as e:
        raise SimulationError(f"the database cannot be used: {e}") from e


def make_key(settings: Settings, text: str) -> int:
    """Create an API key, print it, and return the exit code. text: NAME:ROLE."""
    from trunnion.service.api.server_state.server_components import make_data_folder
    from trunnion.service.api.transport.api_keys_and_rates import ROLES, new_key
    from trunnion.service.store.jobs_events_keys import Store

    name, _, role = text.rpartition(":")
    if not name or role not in ROLES:
        raise SceneError([Problem("--new-key", f"{text!r} is not NAME:ROLE", f"ROLE is one of {', '.join(ROLES)}")])
    make_data_folder(settings)
    store = Store(settings.database_url)
    store.upgrade()
    key, secret = new_key(name, role)
    store.add_key(key)
    store.close()
    print(secret)
    return 0


def listener(host: str, port: int) -> socket.socket:
    """The socket at which the server listens, opened before any other work. SceneError when the address or port is not
    available."""
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
        taken = socket.socket(family, kind, protocol)  # with the protocol TCP, asyncio sends without delay
    except OSError as e:
        what = f"{host!r} is not an address of this machine: {e.strerror or e}"
        raise SceneError([Problem("--host", what, "127.0.0.1 for this machine only, 0.0.0.0 for all its addresses")]) from e
    try:
        if os.name == "posix":  # on other systems, two servers could then share a port
            taken.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        taken.bind(address)
        taken.listen(BACKLOG)
    except OSError as e:
        taken.close()
        if e.errno in (errno.EADDRINUSE, errno.EACCES):
            what = "is in use" if e.errno == errno.EADDRINUSE else "needs more rights"
            hint = (
                f"choose another port, such as --port {port + 1}, or end the program that uses this one"
                if port < 65535
                else "choose another"
            )
            raise SceneError([Problem("--port", f"{port} {what} at {host}", hint)]) from e
        raise SceneError([Problem("--host", f"{host!r} is not an address of this machine: {e.strerror or e}")]) from e
    return taken


def run_server(settings: Settings) -> int:
    """Serve until the process receives the signal to end. Returns the exit code."""
    import uvicorn

    from trunnion.service.server.application import create_app
    from trunnion.service.server.http_connections import SameAccountConnection, TimedConnection

    logging.basicConfig(level=logging.WARNING, format="%(levelname)s %(name)s: %(message)s")
    logging.getLogger("trunnion").setLevel(logging.INFO)
    listening = listener(settings.host, settings.port)
    app = create_app(settings)
    if not settings.open and not app.state.service.store.all_keys():
        print("no keys yet: make the first with trunnion serve --new-key me:admin")
    print(
        f"Trunnion listens at http://{settings.host}:{listening.getsockname()[1]} (data in {settings.data}); Ctrl-C stops it",
        flush=True,
    )
    sys.setswitchinterval(SWITCH_SECONDS)
    gc.freeze()  # exclude all present objects from garbage collection, because each collection stops all threads
    config = uvicorn.Config(
        app,
        settings.host,
        settings.port,
        http=SameAccountConnection if settings.open else TimedConnection,
        log_level="warning",
        timeout_keep_alive=KEEP_ALIVE_SECONDS,
        timeout_graceful_shutdown=GRACE_SECONDS,
    )
    server = uvicorn.Server(config)
    ends_in_time(server)
    server.run(sockets=[listening])
    return 0 if server.started else 1


def ends_in_time(server: Any) -> None:
    """End the process END_SECONDS after the signal to end, even if work is unfinished. The next server resumes this work."""
    graceful = server.handle_exit

    def handle_exit(number: int, frame: Any) -> None:
        if not server.should_exit:
            last = threading.Timer(END_SECONDS, lambda: os._exit(0))
            last.daemon = True
            last.start()
        graceful(number, frame)

    server.handle_exit = handle_exit
