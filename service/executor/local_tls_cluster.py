"""A local Dask cluster without HTTP servers. The cluster creates its TLS certificate at the start."""

from __future__ import annotations

import logging
from typing import Any

from distributed import Nanny, Scheduler, SpecCluster, Worker
from distributed.security import Security


class QuietScheduler(Scheduler):
    """A Dask scheduler without HTTP server."""

    def start_http_server(self, *given: Any, **more: Any) -> None:
        """Do nothing."""


class QuietWorker(Worker):
    """A Dask worker without HTTP server."""

    def start_http_server(self, *given: Any, **more: Any) -> None:
        """Do nothing."""


def local_cluster(workers: int, scratch: str, silence: int) -> SpecCluster:
    """Local worker processes, with a scheduler in this process. Clients and workers must present a certificate. This function
    creates the certificate and keeps it in memory."""
    logging.getLogger("distributed").setLevel(silence)
    security = Security.temporary()
    common = {"host": "127.0.0.1", "protocol": "tls://", "security": security}
    own = {"nthreads": 1, "worker_class": QuietWorker, "local_directory": scratch, "silence_logs": silence}
    worker = {"cls": Nanny, "options": common | own}
    scheduler = {"cls": QuietScheduler, "options": common | {"port": 0, "dashboard": False}}
    return SpecCluster(
        workers=dict.fromkeys(range(workers), worker), scheduler=scheduler, worker=worker, security=security, silence_logs=silence
    )
