"""What every request handler can reach: settings, store, cluster, dispatcher, parts, metrics."""

from __future__ import annotations

import asyncio
import tempfile
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

from fastapi import Request

from engine.basics.problems import Problem, SceneError
from service.api.delivery import Lengths
from service.api.documents import job_document
from service.api.reading import Library
from service.api.reads import Reads
from service.api.tallied import Tallies
from service.desk.desk import Desk
from service.executor.cluster import Cluster
from service.executor.dispatcher import Dispatcher
from service.executor.keeping import Keeper
from service.executor.parts import Parts
from service.executor.telling import Teller
from service.metrics import Metrics
from service.settings import Settings
from service.store.database import Unreachable
from service.store.work import WorkStore

CLERKS, EXPORTERS = 2, 2
"""Processes that check requests, and that export FMUs."""
PULSE_SECONDS = 5.0
"""A database that takes longer to give a sign of life is not one to rely on."""


@dataclass
class Turns:
    """Long requests of one kind: how many there are, and how many of them are worked on. For the event loop only."""

    there: int = 0
    busy: int = 0


class Pulse:
    """Whether the database answers, asked on a thread of its own, which no crowd of requests can keep busy."""

    def __init__(self, store: WorkStore):
        self.store, self.pool = store, ThreadPoolExecutor(1, thread_name_prefix="pulse")

    async def database(self) -> str:
        """ "ok", or what is wrong."""
        try:
            await asyncio.wait_for(asyncio.get_running_loop().run_in_executor(self.pool, self.store.ping), PULSE_SECONDS)
        except (Unreachable, TimeoutError):
            return "unreachable"
        return "ok"


@dataclass
class Service:
    """One server's parts, wired up."""

    settings: Settings
    store: WorkStore
    cluster: Cluster
    parts: Parts
    metrics: Metrics
    dispatcher: Dispatcher
    checks: Desk
    exports: Desk
    pulse: Pulse
    keeper: Keeper
    teller: Teller
    replays: Turns = field(default_factory=Turns)
    derivatives: Turns = field(default_factory=Turns)
    streams: Counter[str] = field(default_factory=Counter)
    library: Library = field(default_factory=Library)
    tallies: Tallies = field(default_factory=Tallies)
    lengths: Lengths = field(default_factory=Lengths)
    reads: Reads = field(default_factory=Reads)

    def close(self) -> None:
        """End everything, in the order in which it is needed no more."""
        self.checks.close()
        self.exports.close()
        self.keeper.stop()
        self.teller.stop()
        self.dispatcher.stop()
        self.cluster.close()
        self.store.close()


def folder_for(settings: Settings) -> None:
    """Make the server's folder; SceneError when nothing can be written there."""
    try:
        settings.data.mkdir(parents=True, exist_ok=True, mode=0o700)
        with tempfile.TemporaryFile(dir=settings.data):
            pass
    except OSError as e:
        what = f"{settings.data} {unwritable(e)}"
        raise SceneError([Problem("--data", what, "give another folder, such as --data ~/jobs")]) from e


def unwritable(e: OSError) -> str:
    """Why a folder cannot be used, in words."""
    return f"cannot be written: {e.strerror or e}"


def made(settings: Settings) -> Service:
    """The parts of a server; the database is brought up to date. SceneError for wrong settings, Unreachable for no database."""
    folder_for(settings)
    store = WorkStore(settings.database_url)
    store.upgrade()
    parts, metrics = Parts(settings.results_url), Metrics()
    if parts.local:
        try:
            parts.check()
        except OSError as e:
            raise SceneError([Problem("--results", f"{parts.root} {unwritable(e)}", "give another folder")]) from e
    cluster = Cluster(settings.scheduler, settings.workers, settings.data / "scratch", settings.tls)
    dispatcher = Dispatcher(store, cluster, parts, settings, metrics)
    checks, exports = Desk(CLERKS, settings.limits.memory), Desk(EXPORTERS, 2 * settings.limits.memory, lasting=False)
    keeper, teller = Keeper(store, parts, settings), Teller(store, settings, job_document)
    return Service(settings, store, cluster, parts, metrics, dispatcher, checks, exports, Pulse(store), keeper, teller)


async def service(request: Request) -> Service:
    """The service a request came to."""
    return request.app.state.service  # type: ignore[no-any-return]
