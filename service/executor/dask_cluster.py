"""The Dask cluster of a server: local processes, or a scheduler with a given address. After a loss, the server connects again."""

from __future__ import annotations

import logging
import os
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from secrets import token_hex
from typing import Any
from weakref import WeakValueDictionary

log = logging.getLogger("trunnion.service")
CONNECT_SECONDS = 10
RETRY_SECONDS = 1.0
COUNT_SECONDS = 1.0
UNWATCHED = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "500ms",
    "distributed.admin.system-monitor.interval": "5s",
}
"""Dask settings that disable or slow measurements for Dask's dashboard, which is not used. These measurements would take two thirds
of the processor time of an idle server."""


OPEN = """connections to this scheduler are not encrypted; anyone who can connect to it can run code on its workers: use a tls://
address (--scheduler-ca, --scheduler-cert, --scheduler-key), or isolate its network"""


class NoCluster(RuntimeError):
    """No cluster is available; a retry can succeed."""


def run_and_report(topic: str, function: Callable[..., Any], *arguments: Any) -> Any:
    """Run a function on a worker. The worker sends the result together with the end of the task. A later request for the result
    would cost a third of the task's messages."""
    from distributed import get_worker

    result, worker = function(*arguments), get_worker()
    worker.log_event(topic, (worker.get_current_task(), result))
    return result


class Cluster:
    """A connection to the cluster. Its futures are cancelled when the scheduler is lost. sent: the futures of ``submit_reporting``
    that are in use, by key; their attribute ``report`` is the result of the function, once the result has arrived."""

    def __init__(self, address: str, workers: int, scratch: Path, tls: Mapping[str, str] | None = None):
        self.address, self.scratch, self.tls = address, scratch, tls
        if address.startswith("tcp://"):
            log.warning("%s: %s", address, OPEN)
        self.wanted = workers or os.cpu_count() or 1
        self.client: Any = None
        self.local: Any = None
        self.counted, self.counted_at = 0, -COUNT_SECONDS
        self.lock = threading.Lock()
        self.failed_at = 0.0
        self.sent: WeakValueDictionary[str, Any] = WeakValueDictionary()
        self._topic = f"trunnion-{token_hex(8)}"

    def connect(self) -> Any:
        """The connected Dask client. Raises NoCluster when the cluster cannot be reached."""
        with self.lock:
            if self.client is not None and self.client.status == "running":
                return self.client
            if self.client is not None and self.client.status == "connecting":
                raise NoCluster("the scheduler is out of reach; reconnecting")
            if time.monotonic() - self.failed_at < RETRY_SECONDS:
                raise NoCluster("the cluster could not be reached a moment ago")
            self._drop()
            try:
                self._make()
            except Exception as e:
                self.failed_at = time.monotonic()
                self._drop()
                raise NoCluster(f"{self.address or 'local cluster'}: {e}") from e
            return self.client

    def _make(self) -> None:
        from dask import config
        from distributed import Client
        from distributed.security import Security

        if not self.address:
            from trunnion.service.executor.local_tls_cluster import local_cluster

            config.set(UNWATCHED)
            self.scratch.mkdir(parents=True, exist_ok=True, mode=0o700)
            self.local = local_cluster(self.wanted, str(self.scratch), logging.ERROR)
        shown = {"security": Security(require_encryption=True, **self.tls)} if self.tls else {}
        self.client = Client(self.local or self.address, timeout=CONNECT_SECONDS, set_as_default=False, **shown)
        self.client.subscribe_topic(self._topic, self._take_report)
        log.info("cluster: %s", self.client)

    def _drop(self) -> None:
        for thing in (self.client, self.local):
            if thing is not None:
                with suppress(Exception):
                    thing.close(timeout=2)
        self.client = self.local = None

    def slots(self) -> int:
        """The number of chunks that can run at the same time (0 without workers). Raises NoCluster when the cluster cannot
        be reached."""
        if time.monotonic() - self.counted_at > COUNT_SECONDS:
            client = self.connect()
            try:
                if self.local is None:
                    self.counted = sum(client.nthreads(callback_timeout=CONNECT_SECONDS).values())
                else:
                    self.counted = self.local.scheduler.total_nthreads
            except Exception as e:
                raise NoCluster(str(e)) from e
            self.counted_at = time.monotonic()
        return self.counted

    def submit(self, function: Callable[..., Any], *arguments: Any, priority: int = 0) -> Any:
        """The future of a function call on the cluster. Raises NoCluster when the cluster cannot be reached."""
        client = self.connect()
        try:
            return client.submit(function, *arguments, pure=False, priority=priority)
        except Exception as e:
            raise NoCluster(str(e)) from e

    def submit_reporting(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """The future of a function call whose result consists of plain data. NoCluster as for ``submit``."""
        future = self.submit(run_and_report, self._topic, function, *arguments)
        self.sent[future.key] = future
        return future

    def _take_report(self, event: tuple[float, Any]) -> None:
        """Attach a result that a worker sent to its future."""
        key, result = event[1]
        if (future := self.sent.get(key)) is not None:
            future.report = result

    def close(self) -> None:
        """End the local cluster, or disconnect from the scheduler."""
        with self.lock:
            self._drop()
