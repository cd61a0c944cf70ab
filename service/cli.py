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

from engine.basics.extras import absent
from engine.basics.problems import Problem, SceneError, SimulationError
from service.options import (
    DATA,
    DATABASE,
    HOST,
    KEEP,
    LIMIT,
    NEW_KEY,
    RESULTS,
    SCHEDULER,
    WEBHOOK,
    certificates_of,
    kept_for,
    limits_of,
    pem,
)  # fmt: skip
from service.settings import Settings

GRACE_SECONDS, END_SECONDS = 2, 4.0
"""Time for requests under way when the server is told to end, and for everything."""
BACKLOG = 2048
"""Connections that may wait to be accepted, as uvicorn has it."""
SWITCH_SECONDS = 0.0005
"""How soon a thread that makes rows into text lets those go on that answer: Python's own 5 ms would be waited for some ten times a
request."""


def serve(
    data: Annotated[Path, DATA] = Path("trunnion-data"),
    host: Annotated[str, HOST] = "127.0.0.1",
    port: Annotated[int, typer.Option(metavar="PORT", min=0, max=65535)] = 8765,
    database: Annotated[str, DATABASE] = "",
    results: Annotated[str, RESULTS] = "",
    scheduler: Annotated[str, SCHEDULER] = "",
    scheduler_ca: Annotated[Path | None, pem("the authority that signed the scheduler's certificate", "CA")] = None,
    scheduler_cert: Annotated[Path | None, pem("this server's certificate", "CERT")] = None,
    scheduler_key: Annotated[Path | None, pem("its key", "KEY")] = None,
    workers: Annotated[int, typer.Option(metavar="N", min=0, help="Processes, without a scheduler (default: one a core).")] = 0,
    keys: Annotated[bool, typer.Option("--keys", help="Ask for keys on this machine too.")] = False,
    rate: Annotated[str, typer.Option(metavar="RATE", help="Most requests a key, such as 1200/minute.")] = "",
    limit: Annotated[list[str] | None, LIMIT] = None,
    keep: Annotated[str, KEEP] = "",
    webhook: Annotated[list[str] | None, WEBHOOK] = None,
    new_key: Annotated[str, NEW_KEY] = "",
    lease: Annotated[float, typer.Option(hidden=True, min=0.3)] = 6.0,
    retry_delay: Annotated[float, typer.Option(hidden=True, min=0.0)] = 2.0,
    chunk_seconds: Annotated[float, typer.Option(hidden=True, min=0.01)] = 2.0,
) -> None:
    """Serve batches over HTTP, with a web page at /."""
    if problems := absent("service", "trunnion serve"):
        raise SceneError(problems)
    from service.store.database import Unreachable

    limits, certificates = limits_of(rate, limit or []), certificates_of(scheduler, scheduler_ca, scheduler_cert, scheduler_key)
    settings = Settings(
        data, host, port, database, results, scheduler, workers, certificates, keys, limits, chunk_seconds,
        retry_delay=retry_delay, lease=lease, keep=kept_for(keep), webhooks=tuple(webhook or ()),
        webhook_secret=os.environ.get("TRUNNION_WEBHOOK_SECRET", ""),
    )  # fmt: skip
    try:
        raise typer.Exit(_make_key(settings, new_key) if new_key else _serve(settings))
    except Unreachable as e:
        raise SimulationError(f"the database cannot be used: {e}") from e


def _make_key(settings: Settings, text: str) -> int:
    """Make a key and print it."""
    from service.api.security import ROLES, new_key
    from service.api.service import folder_for
    from service.store.store import Store

    name, _, role = text.rpartition(":")
    if not name or role not in ROLES:
        raise SceneError([Problem("--new-key", f"{text!r} is not NAME:ROLE", f"ROLE is one of {', '.join(ROLES)}")])
    folder_for(settings)
    store = Store(settings.database_url)
    store.upgrade()
    key, secret = new_key(name, role)
    store.add_key(key)
    store.close()
    print(secret)
    return 0


def listener(host: str, port: int) -> socket.socket:
    """The socket to listen on, taken before anything else is started; SceneError when it cannot be had."""
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
        taken = socket.socket(family, kind, protocol)  # asyncio sends answers at once only where it is told that this is TCP
    except OSError as e:
        what = f"{host!r} is no address of this machine: {e.strerror or e}"
        raise SceneError([Problem("--host", what, "127.0.0.1 for this machine alone, 0.0.0.0 for all its addresses")]) from e
    try:
        if os.name == "posix":  # elsewhere it would let two servers share a port
            taken.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        taken.bind(address)
        taken.listen(BACKLOG)
    except OSError as e:
        taken.close()
        if e.errno in (errno.EADDRINUSE, errno.EACCES):
            what = "is in use" if e.errno == errno.EADDRINUSE else "may not be used by you"
            hint = f"choose another, such as --port {port + 1}, or end what listens there" if port < 65535 else "choose another"
            raise SceneError([Problem("--port", f"{port} {what} at {host}", hint)]) from e
        raise SceneError([Problem("--host", f"{host!r} is no address of this machine: {e.strerror or e}")]) from e
    return taken


def _serve(settings: Settings) -> int:
    """Serve until stopped."""
    import uvicorn

    from service.app import create_app
    from service.connections import OwnOnly, Timely

    logging.basicConfig(level=logging.WARNING, format="%(levelname)s %(name)s: %(message)s")
    logging.getLogger("trunnion").setLevel(logging.INFO)
    listening = listener(settings.host, settings.port)
    app = create_app(settings)
    if not settings.open and not app.state.service.store.all_keys():
        print("no keys yet: make the first with trunnion serve --new-key me:admin")
    print(f"Trunnion at http://{settings.host}:{listening.getsockname()[1]} (data in {settings.data}); end with Ctrl-C", flush=True)
    sys.setswitchinterval(SWITCH_SECONDS)
    gc.freeze()  # what is there now stays: nothing else goes on while it is looked through for garbage
    config = uvicorn.Config(app, settings.host, settings.port, log_level="warning", timeout_graceful_shutdown=GRACE_SECONDS)
    config.http = OwnOnly if settings.open else Timely
    server = uvicorn.Server(config)
    ends_in_time(server)
    server.run(sockets=[listening])
    return 0 if server.started else 1


def ends_in_time(server: Any) -> None:
    """Let a server that is told to end be gone after END_SECONDS, whatever still goes on in it. What it worked on is taken up again
    by the next one."""
    asked = server.handle_exit

    def told(number: int, frame: Any) -> None:
        if not server.should_exit:
            last = threading.Timer(END_SECONDS, lambda: os._exit(0))
            last.daemon = True
            last.start()
        asked(number, frame)

    server.handle_exit = told
