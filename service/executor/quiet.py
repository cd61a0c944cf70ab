"""A scheduler and workers of this machine that answer nobody else: TLS with certificates of their own, and no HTTP port."""

from __future__ import annotations

import logging
from typing import Any

from distributed import Nanny, Scheduler, SpecCluster, Worker
from distributed.security import Security


class QuietScheduler(Scheduler):
    """A scheduler without its HTTP server."""

    def start_http_server(self, *given: Any, **more: Any) -> None:
        """Start none."""


class QuietWorker(Worker):
    """A worker without its HTTP server."""

    def start_http_server(self, *given: Any, **more: Any) -> None:
        """Start none."""


def local_cluster(workers: int, scratch: str, silence: int) -> SpecCluster:
    """Worker processes of this machine with a scheduler in this process. Whoever connects has to show the certificate that is made
    here for this cluster alone, and is kept in memory."""
    logging.getLogger("distributed").setLevel(silence)
    security = Security.temporary()
    common = {"host": "127.0.0.1", "protocol": "tls://", "security": security}
    own = {"nthreads": 1, "worker_class": QuietWorker, "local_directory": scratch, "silence_logs": silence}
    worker = {"cls": Nanny, "options": common | own}
    scheduler = {"cls": QuietScheduler, "options": common | {"port": 0, "dashboard": False}}
    return SpecCluster(
        workers=dict.fromkeys(range(workers), worker), scheduler=scheduler, worker=worker, security=security, silence_logs=silence
    )
