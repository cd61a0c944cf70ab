"""What every request handler can reach: settings, store, cluster, dispatcher, parts, metrics."""

from __future__ import annotations

from dataclasses import dataclass, field

from fastapi import Request

from service.api.reading import Library
from service.executor.cluster import Cluster
from service.executor.dispatcher import Dispatcher
from service.executor.parts import Parts
from service.metrics import Metrics
from service.settings import Settings
from service.store.work import WorkStore


@dataclass
class Turns:
    """Long requests of one kind: how many there are, and how many of them are worked on. For the event loop only."""

    there: int = 0
    busy: int = 0


@dataclass
class Service:
    """One server's parts, wired up."""

    settings: Settings
    store: WorkStore
    cluster: Cluster
    parts: Parts
    metrics: Metrics
    dispatcher: Dispatcher
    replays: Turns = field(default_factory=Turns)
    derivatives: Turns = field(default_factory=Turns)
    exports: Turns = field(default_factory=Turns)
    streams: int = 0
    library: Library = field(default_factory=Library)


def made(settings: Settings) -> Service:
    """The parts of a server; the database is brought up to date. SceneError for wrong settings, Unreachable for no database."""
    settings.data.mkdir(parents=True, exist_ok=True, mode=0o700)
    store = WorkStore(settings.database_url)
    store.upgrade()
    parts, metrics = Parts(settings.results_url), Metrics()
    cluster = Cluster(settings.scheduler, settings.workers, settings.data / "scratch")
    dispatcher = Dispatcher(store, cluster, parts, settings, metrics)
    return Service(settings, store, cluster, parts, metrics, dispatcher)


def service(request: Request) -> Service:
    """The service a request came to."""
    return request.app.state.service  # type: ignore[no-any-return]
