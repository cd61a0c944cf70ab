"""Settings of a server: storage, cluster, limits."""

from __future__ import annotations

import ipaddress
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

KEEP_PERIOD = 600.0
"""Time between two searches for expired jobs, s. A job is kept for at least this long."""


@dataclass(frozen=True)
class Limits:
    """Upper limits of requests and jobs.

    body: size of a request, bytes. bodies: number of bodies in a scene. cases: number of cases in a job. duration: simulated time
    of a case, s. rows: number of output rows of a case. output_bytes: size of a job's table. job_seconds: computing time of a job,
    s. cpu_limit, max_steps: processor time, s, and number of steps of a case. answer_seconds: time for a result that the server
    computes while the client waits (case that runs again, sensitivity, FMU), s. check_seconds: time to read and check a request, s.
    memory: address space of a checking process, bytes; an FMU export has twice as much. waiting: number of queued or running jobs.
    key_jobs: number of active jobs of a key. key_bytes: number of stored bytes of a key. key_cases: number of cases of a key per
    day. rate: rate of requests with a key or, without keys, from an address, such as "20/second"; "" for no limit."""

    body: int = 2_000_000
    bodies: int = 128
    cases: int = 2_000_000
    duration: float = 100_000.0
    rows: int = 10_000_000
    output_bytes: int = 4_000_000_000
    job_seconds: float = 86_400.0
    cpu_limit: float = 600.0
    max_steps: float = 100_000_000.0
    answer_seconds: float = 120.0
    check_seconds: float = 10.0
    memory: float = 4e9
    waiting: int = 10_000
    key_jobs: int = 1_000
    key_bytes: float = 100e9
    key_cases: float = 50e6
    rate: str = ""


@dataclass(frozen=True)
class Settings:
    """Settings of a server.

    data: default folder of database, results and scratch files. database: SQLAlchemy URL. results: fsspec URL. scheduler: address
    of a Dask scheduler; "" for ``workers`` local processes. tls: PEM files for a TLS scheduler, as arguments of
    ``distributed.security.Security``. chunk_seconds: longest duration of a chunk, s. attempts: largest number of attempts to run a
    chunk. keep: time until ended jobs are deleted, s; 0 for never. webhooks: URL prefixes of addresses that jobs may notify.
    webhook_secret: secret that signs webhooks; "" for a generated secret."""

    data: Path
    host: str = "127.0.0.1"
    port: int = 8765
    database: str = ""
    results: str = ""
    scheduler: str = ""
    workers: int = 0
    tls: Mapping[str, str] | None = None
    require_keys: bool = False
    limits: Limits = field(default_factory=Limits)
    chunk_seconds: float = 2.0
    attempts: int = 5
    retry_delay: float = 2.0
    lease: float = 6.0
    keep: float = 0.0
    webhooks: tuple[str, ...] = ()
    webhook_secret: str = ""

    @property
    def database_url(self) -> str:
        """The SQLAlchemy URL of the database; by default, an SQLite file in the data folder."""
        return self.database or f"sqlite:///{(self.data / 'trunnion.db').absolute()}"

    @property
    def results_url(self) -> str:
        """The fsspec URL of the folder that holds the parts."""
        return self.results or str((self.data / "results").absolute())

    @property
    def open(self) -> bool:
        """Whether requests are allowed without a key, because only this machine can reach the server and ``require_keys`` is not
        set."""
        return is_loopback(self.host) and not self.require_keys


def is_loopback(host: str) -> bool:
    """Whether a host name or address is a loopback address."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
