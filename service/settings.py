"""What a server is told: where it keeps things, where it computes, what it allows."""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True)
class Limits:
    """The most a request may ask for. body: bytes of a request; duration: simulated seconds; rows: output rows of a case;
    output_bytes: size of a job's table; job_seconds: seconds of building and stepping of a job; patience, steps: processor seconds
    and steps of a case (a job's own ``patience`` and ``steps`` are at most these); answer_seconds: seconds of work for what is
    answered at once (a case run again, a sensitivity, an FMU); check_seconds: seconds of reading and checking a request; memory:
    bytes of address space of a process that does that (twice as much of one that exports an FMU); waiting: jobs that may be queued
    or running; rate: requests that a key (or, without keys, an address) may make, such as "20/second", "" for any number."""

    body: int = 2_000_000
    bodies: int = 128
    cases: int = 2_000_000
    duration: float = 100_000.0
    rows: int = 10_000_000
    output_bytes: int = 4_000_000_000
    job_seconds: float = 86_400.0
    patience: float = 600.0
    steps: float = 100_000_000.0
    answer_seconds: float = 120.0
    check_seconds: float = 10.0
    memory: float = 4e9
    waiting: int = 10_000
    key_jobs: int = 1_000
    key_bytes: float = 100e9
    key_cases: float = 50e6
    rate: str = ""


@dataclass(frozen=True)
class Certificates:
    """Files (PEM) by which a scheduler and this server know each other: of the authority that signs both, this server's
    certificate, and its key."""

    authority: Path
    certificate: Path
    key: Path

    def given(self) -> dict[str, str]:
        """As ``distributed.security.Security`` takes them."""
        return {"tls_ca_file": str(self.authority), "tls_client_cert": str(self.certificate), "tls_client_key": str(self.key)}


@dataclass(frozen=True)
class Settings:
    """data: folder for the database, results and scratch files unless they are given elsewhere. database: SQLAlchemy URL. results:
    fsspec URL. scheduler: address of a Dask scheduler, "" for a cluster of ``workers`` processes on this machine; tls: what it asks
    to be shown.
    chunk_seconds: longest a chunk should take; keep: seconds after which jobs that have ended are deleted, 0 for never;
    webhooks: addresses below which ends of jobs may be told; webhook_secret: by which that is signed, "" for one of its own."""

    data: Path
    host: str = "127.0.0.1"
    port: int = 8765
    database: str = ""
    results: str = ""
    scheduler: str = ""
    workers: int = 0
    tls: Certificates | None = None
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
        """SQLAlchemy URL of the database: the one given, or an SQLite file in the data folder."""
        return self.database or f"sqlite:///{(self.data / 'trunnion.db').absolute()}"

    @property
    def results_url(self) -> str:
        """fsspec URL of the folder where parts are written."""
        return self.results or str((self.data / "results").absolute())

    @property
    def open(self) -> bool:
        """Whether requests need no key: only where nobody but this machine can reach the server."""
        return is_loopback(self.host) and not self.require_keys


def is_loopback(host: str) -> bool:
    """Whether a host name or address is this machine only."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
