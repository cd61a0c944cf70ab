"""``trunnion serve``."""

from __future__ import annotations

import errno
import gc
import logging
import os
import socket
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any

import typer

from trunnion.basics.control_characters import visible
from trunnion.basics.errors import Problem, SceneError, SimulationError, raise_problems
from trunnion.basics.optional_packages import absent
from trunnion.basics.renamed_words import SETTINGS, current
from trunnion.service.basics.server_settings import KEEP_PERIOD, Limits, Settings

GRACE_SECONDS, END_SECONDS = 2, 4.0
"""Limits of time, s, after the signal to end. GRACE_SECONDS: for requests in progress. END_SECONDS: until the process ends."""
KEEP_ALIVE_SECONDS = 75
"""Time for which an idle connection stays open, s. Clients have a shorter time (httpx 5 s, nginx 60 s), so that the client closes
the connection first. If the server closed first, a request sent at the same moment would fail."""
BACKLOG = 2048
"""Number of connections that may wait to be accepted (uvicorn's default)."""
SWITCH_SECONDS = 0.0005
"""Longest time, s, for which a thread that formats rows blocks the other threads. With Python's default of 5 ms, such a thread
could delay a request by 5 ms about ten times."""


def pem(what: str, name: str) -> Any:
    """The option for a PEM file that a scheduler with a tls:// address needs. what: content of the file. name: end of the
    environment variable's name."""
    return typer.Option(metavar="FILE", help=f"With a tls:// scheduler: {what} (PEM).", envvar=f"TRUNNION_SCHEDULER_{name}")


def from_environment(name: str, metavar: str, text: str, default: str | bool = True) -> Any:
    """A command-line option. The environment variable ``TRUNNION_NAME`` also sets its value. text: help text. default: description
    of the default."""
    return typer.Option(metavar=metavar, help=text, show_default=default, envvar=f"TRUNNION_{name}")


def limit_names() -> list[str]:
    """The names of all limits whose values are numbers."""
    return [f.name for f in fields(Limits) if f.name != "rate"]


Data = Annotated[Path, from_environment("DATA", "DIR", "Folder of the database, results and scratch files.")]
Host = Annotated[
    str,
    typer.Option(
        metavar="HOST", help="Address at which the server listens. An address that other machines can reach requires API keys."
    ),
]
Database = Annotated[
    str, from_environment("DATABASE", "URL", "Address of the database: postgresql://… or sqlite:///file.", "a file in DIR")
]
Results = Annotated[str, from_environment("RESULTS", "URL", "Place of the results: a folder or an fsspec URL.", "a folder in DIR")]
Scheduler = Annotated[
    str,
    from_environment("SCHEDULER", "ADDRESS", "Address of a Dask scheduler, such as tls://host:8786.", "processes of this machine"),
]
CaFile = Annotated[Path | None, pem("certificate of the authority that signed the scheduler's certificate", "CA")]
CertFile = Annotated[Path | None, pem("this server's certificate", "CERT")]
KeyFile = Annotated[Path | None, pem("private key of this server's certificate", "KEY")]
LimitWords = Annotated[
    list[str], typer.Option("--limit", metavar="NAME=N", help=f"Set a limit: {', '.join(limit_names())}.", default_factory=list)
]
Keep = Annotated[
    str, from_environment("KEEP", "TIME", "Time from the end of a job until its deletion, such as 30d or 12h.", "never")
]
Webhooks = Annotated[
    list[str],
    typer.Option(
        "--webhook", metavar="URL",
        help="Allow jobs to report their end to addresses that begin with this URL.", default_factory=list,
        envvar="TRUNNION_WEBHOOK",
    ),
]  # fmt: skip
NewKey = Annotated[
    str,
    typer.Option(
        "--new-key",
        metavar="NAME:ROLE",
        help="Create and print an API key, without starting the server. ROLE: read, submit or admin. Every key can read all jobs.",
    ),
]


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
    raise_problems(absent("service", "trunnion serve"))
    from trunnion.service.store.database_connection import Unreachable

    limits, certificates = limits_of(rate, limit), certificates_of(scheduler, scheduler_ca, scheduler_cert, scheduler_key)
    settings = Settings(
        data, host, port, database, results, scheduler, workers, certificates, keys, limits, chunk_seconds,
        retry_delay=retry_delay, lease=lease, keep=kept_for(keep), webhooks=tuple(webhook),
        webhook_secret=os.environ.get("TRUNNION_WEBHOOK_SECRET", ""),
    )  # fmt: skip
    try:
        with private_files():
            return make_key(settings, new_key) if new_key else run_server(settings)
    except Unreachable as e:
        raise SimulationError(f"the database cannot be used: {e}") from e


@contextmanager
def private_files() -> Iterator[None]:
    """A context in which this process and its workers create files and folders that other accounts cannot read."""
    before = os.umask(0o077)
    try:
        yield
    finally:
        os.umask(before)


def certificates_of(scheduler: str, *files: Path | None) -> dict[str, str] | None:
    """The certificates for the scheduler; None if no file is given, so that Dask's own configuration applies. SceneError with all
    mistakes."""
    options = ("--scheduler-ca", "--scheduler-cert", "--scheduler-key")
    given = [f for f in files if f is not None]
    if not given:
        return None
    missing = [o for o, f in zip(options, files, strict=True) if f is None]
    problems = [Problem(o, "is not given", f"give all of {', '.join(options)}, or none of them") for o in missing]
    problems += [Problem(o, f"there is no file {str(f)!r}") for o, f in zip(options, files, strict=True) if f and not f.is_file()]
    if not scheduler.startswith("tls://"):
        problems.append(Problem("--scheduler", f"{scheduler!r} is not a tls:// address", "such as tls://host:8786"))
    raise_problems(problems)
    return dict(zip(("tls_ca_file", "tls_client_cert", "tls_client_key"), map(str, given), strict=True))


def limits_of(rate: str, texts: list[str]) -> Limits:
    """The limits that the options set. rate: value of ``--rate``. texts: values of ``--limit``. SceneError with all mistakes."""
    from trunnion.service.api.transport.api_keys_and_rates import Rates

    problems, given = [], {}
    try:
        Rates(rate)
    except ValueError:
        problems.append(Problem("--rate", f"{rate!r} is not a rate", "such as 1200/minute or 20/second"))
    for text in texts:
        name, _, value = text.partition("=")
        name = current("limit", SETTINGS, name)
        try:
            given[name] = type(getattr(Limits, name) if name in limit_names() else 0)(float(value))
        except (ValueError, OverflowError):
            problems.append(Problem("--limit", f"{text!r} is not NAME=N", "such as cases=100000"))
        if name not in limit_names():
            problems.append(Problem("--limit", f"there is no limit {name!r}", f"one of {', '.join(limit_names())}"))
    raise_problems(problems)
    return Limits(rate=rate, **given)


KEPT_UNITS = {"s": 1.0, "m": 60.0, "h": 3600.0, "d": 86_400.0}


def kept_for(text: str) -> float:
    """The seconds in a time such as 30d, 12h or 0. SceneError for any other text, and for times that are
    too short."""
    number, unit = (text[:-1], text[-1:]) if text[-1:] in KEPT_UNITS else (text, "s")
    try:
        seconds = float(number or "0") * KEPT_UNITS[unit]
    except ValueError:
        seconds = -1.0
    if not 0.0 <= seconds < float("inf"):
        raise SceneError([Problem("--keep", f"{text!r} is not a time", "such as 30d, 12h or 45m")])
    if 0.0 < seconds < KEEP_PERIOD:
        what = f"{text} is shorter than the {KEEP_PERIOD / 60.0:g} min after which the server looks for expired jobs"
        raise SceneError([Problem("--keep", what, "give a longer time")])
    return seconds


def make_key(settings: Settings, text: str) -> int:
    """Create an API key, print it, and return the exit code. text: NAME:ROLE."""
    from trunnion.service.api.server_state.server_components import make_data_folder
    from trunnion.service.api.transport.api_keys_and_rates import ROLES, new_key
    from trunnion.service.store.job_store import Store

    name, _, role = text.rpartition(":")
    if not name or role not in ROLES or visible(name) != name:
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
        if os.name == "posix":  # on Windows, this option would allow two servers to share a port
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
    gc.freeze()  # exclude all present objects from garbage collection, because a collection stops all threads
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
    """End the process END_SECONDS after the signal to end, even if work is unfinished. The next server resumes unfinished work."""
    graceful = server.handle_exit

    def handle_exit(number: int, frame: Any) -> None:
        if not server.should_exit:
            last = threading.Timer(END_SECONDS, lambda: os._exit(0))
            last.daemon = True
            last.start()
        graceful(number, frame)

    server.handle_exit = handle_exit
