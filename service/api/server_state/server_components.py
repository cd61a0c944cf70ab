"""The components of a server that request handlers use, such as settings, store, cluster, dispatcher, parts, metrics and caches."""

from __future__ import annotations

import asyncio
import logging
import os
import shlex
import tempfile
import threading
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from fastapi import Request

from trunnion.analysis.studies.study_rounds import StudyProgress
from trunnion.basics.errors import Problem, SceneError
from trunnion.batch.plan_and_runner import Plan
from trunnion.service.api.documents.job_document import job_document
from trunnion.service.api.server_state.row_read_queue import ReadTurns
from trunnion.service.basics.prometheus_metrics import Metrics
from trunnion.service.basics.recently_used_cache import RecentItems
from trunnion.service.basics.server_settings import Settings
from trunnion.service.executor.chunk_dispatcher import Dispatcher
from trunnion.service.executor.dask_cluster import Cluster
from trunnion.service.executor.job_retention import JobRetention
from trunnion.service.executor.parquet_parts import Parts
from trunnion.service.executor.parts_of_earlier_versions import adopt_parts
from trunnion.service.executor.webhooks import WebhookSender
from trunnion.service.request_workers.worker_processes import WorkerPool
from trunnion.service.store.database_connection import Unreachable
from trunnion.service.store.leases_and_chunks import WorkStore

log = logging.getLogger("trunnion.service")
CACHED_JOBS, CACHED_LENGTHS = 64, 256
Make = Callable[[], Iterator[bytes]]
"""A function that creates the bytes of a response."""
CHECK_PROCESSES, RUN_PROCESSES, EXPORT_PROCESSES = 2, 2, 2
"""Numbers of processes that check requests, that run scenes at once, and that export FMUs."""
PROBE_SECONDS = 5.0
"""Longest time, s, of a probe of the database. If a probe takes longer, the database counts as not ready."""


@dataclass(frozen=True)
class JobContents:
    """The immutable contents of a job's document: plan, schema of the result table, digest and text of the document."""

    plan: Plan
    schema: Any
    digest: str
    text: str


@dataclass
class Turns:
    """Counts of long requests of one kind. there: number of waiting and running requests. busy: number of running requests. Only
    for use in the event loop."""

    there: int = 0
    busy: int = 0


@dataclass
class Service:
    """The components of a server. contents, studies: caches by job. lengths: cache of the lengths of responses, by entity tag."""

    settings: Settings
    store: WorkStore
    cluster: Cluster
    parts: Parts
    metrics: Metrics
    dispatcher: Dispatcher
    checks: WorkerPool
    runs: WorkerPool
    exports: WorkerPool
    retention: JobRetention
    webhook_sender: WebhookSender
    pulse: ThreadPoolExecutor = field(default_factory=partial(ThreadPoolExecutor, 1, thread_name_prefix="pulse"))
    replays: Turns = field(default_factory=Turns)
    derivatives: Turns = field(default_factory=Turns)
    streams: Counter[str] = field(default_factory=Counter)
    contents: RecentItems[str, JobContents] = field(default_factory=partial(RecentItems, CACHED_JOBS))
    studies: RecentItems[str, StudyProgress] = field(default_factory=partial(RecentItems, CACHED_JOBS))
    study_lock: threading.Lock = field(default_factory=threading.Lock)
    lengths: RecentItems[str, int] = field(default_factory=partial(RecentItems, CACHED_LENGTHS))
    reads: ReadTurns = field(default_factory=ReadTurns)

    async def database_state(self) -> str:
        """The state of the database: "ok" or "unreachable". A separate thread probes the database, so that a high load of requests
        cannot delay the probe."""
        try:
            await asyncio.wait_for(asyncio.get_running_loop().run_in_executor(self.pulse, self.store.ping), PROBE_SECONDS)
        except (Unreachable, TimeoutError):
            return "unreachable"
        return "ok"

    def close(self) -> None:
        """End all components. Each component ends before the components that it uses."""
        self.checks.close()
        self.runs.close()
        self.exports.close()
        self.retention.stop()
        self.webhook_sender.stop()
        self.dispatcher.stop()
        self.cluster.close()
        self.store.close()


OURS = ("trunnion.db", "trunnion.db-wal", "trunnion.db-shm", "results", "scratch", "webhook.secret")
"""Names of the server's files and folders in the data folder."""


def close_data_folder(data: Path) -> None:
    """Withdraw the rights of other accounts to the server's files in the data folder. The data folder itself keeps its rights,
    because it may hold other files. A warning names the files and folders that other accounts may still read."""
    left = []
    for path in (data / name for name in OURS):
        with suppress(FileNotFoundError):
            if (mode := path.stat().st_mode) & 0o077:
                try:
                    path.chmod(mode & 0o700)
                except OSError:
                    left.append(path)
    if data.stat().st_mode & 0o077:
        left.append(data)
    if left and os.name == "posix":
        places = shlex.join(map(str, left))
        log.warning("other accounts may read %s; to prevent this, run: chmod go-rwx %s", places, places)


def make_data_folder(settings: Settings) -> None:
    """Make the data folder, and close the server's files in it to other accounts. SceneError when the folder is not writable."""
    try:
        settings.data.mkdir(parents=True, exist_ok=True, mode=0o700)
        with tempfile.TemporaryFile(dir=settings.data):
            pass
        close_data_folder(settings.data)
    except OSError as e:
        what = f"{settings.data} {write_error_text(e)}"
        raise SceneError([Problem("--data", what, "choose another folder, such as --data ~/jobs")]) from e


def write_error_text(e: OSError) -> str:
    return f"cannot be written: {e.strerror or e}"


def create_service(settings: Settings) -> Service:
    """Create the components of a server and migrate the database. Raises SceneError for wrong settings, and Unreachable when the
    database does not respond."""
    make_data_folder(settings)
    store = WorkStore(settings.database_url)
    store.upgrade()
    parts, metrics = Parts(settings.results_url), Metrics()
    if parts.local:
        try:
            parts.check()
        except OSError as e:
            raise SceneError([Problem("--results", f"{parts.root} {write_error_text(e)}", "choose another folder")]) from e
    adopt_parts(store, parts)
    cluster = Cluster(settings.scheduler, settings.workers, settings.data / "scratch", settings.tls)
    dispatcher = Dispatcher(store, cluster, parts, settings, metrics)
    memory = settings.limits.memory
    checks, runs = WorkerPool(CHECK_PROCESSES, memory), WorkerPool(RUN_PROCESSES, memory)
    exports = WorkerPool(EXPORT_PROCESSES, 2 * memory, lasting=False)
    retention, sender = JobRetention(store, parts, settings), WebhookSender(store, settings, job_document)
    return Service(settings, store, cluster, parts, metrics, dispatcher, checks, runs, exports, retention, sender)


async def service(request: Request) -> Service:
    """The components of the server that handles a request."""
    return request.app.state.service  # type: ignore[no-any-return]
