"""Data classes for the records of the store."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Job:
    """A stored job. Times are seconds since the epoch. counts: number of cases by outcome. lost: number of cases in failed chunks.
    seconds: time of stepping, s. pace: recent wall time of a case, s. landed: time at which the last rows arrived. asked: number of
    known cases of a study, None for other jobs. ends: digest of the chunk ends, "" while unknown."""

    id: str
    created: float
    started: float | None
    finished: float | None
    owner: str
    digest: str
    scene: str
    label: str
    state: str
    cases: int
    planned: int
    done: int
    lost: int
    counts: dict[str, int]
    seconds: float
    build_seconds: float
    bytes: int
    budget: float
    problems: list[dict[str, Any]]
    pace: float = 0.0
    landed: float | None = None
    tags: tuple[str, ...] = ()
    asked: int | None = None
    ends: str = ""


@dataclass(frozen=True)
class Chunk:
    """A chunk: the cases start … stop − 1 of a job. attempts: number of attempts. not_before: earliest time of the next attempt."""

    job: str
    start: int
    stop: int
    state: str
    attempts: int
    not_before: float
    error: str


@dataclass(frozen=True)
class StoredEvent:
    """An event of a job. Later events have larger ids."""

    id: int
    job: str
    time: float
    kind: str
    data: dict[str, Any]


@dataclass(frozen=True)
class Key:
    """An API key without its secret."""

    id: str
    name: str
    role: str
    hash: str
    created: float
    revoked: float | None


def job_of(row: Any) -> Job:
    """The job in a database row."""
    fields = {name: row[name] for name in Job.__dataclass_fields__}
    read = {name: json.loads(row[name]) for name in ("counts", "problems")}
    return Job(**fields | read | {"tags": tuple(json.loads(row["tags"]))})


def chunk_of(row: Any) -> Chunk:
    """The chunk in a database row."""
    return Chunk(**{name: row[name] for name in Chunk.__dataclass_fields__})


def event_of(row: Any) -> StoredEvent:
    """The event in a database row."""
    return StoredEvent(row["id"], row["job"], row["time"], row["kind"], json.loads(row["data"]))


def key_of(row: Any) -> Key:
    """The key in a database row."""
    return Key(**{name: row[name] for name in Key.__dataclass_fields__})
