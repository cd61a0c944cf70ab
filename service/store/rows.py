"""What the store hands out: jobs, chunks, events and keys as plain frozen data."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Job:
    """A job as kept. Times in s since the epoch; counts: cases by outcome; lost: cases of failed chunks; seconds: stepping."""

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


@dataclass(frozen=True)
class Chunk:
    """Cases start … stop − 1 of a job; attempts so far."""

    job: str
    start: int
    stop: int
    state: str
    attempts: int
    not_before: float
    error: str


@dataclass(frozen=True)
class StoredEvent:
    """Something that happened to a job; ids grow."""

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
    """A job of a row of the table."""
    fields = {name: row[name] for name in Job.__dataclass_fields__}
    return Job(**fields | {"counts": json.loads(row["counts"]), "problems": json.loads(row["problems"])})


def chunk_of(row: Any) -> Chunk:
    """A chunk of a row."""
    return Chunk(**{name: row[name] for name in Chunk.__dataclass_fields__})


def event_of(row: Any) -> StoredEvent:
    """An event of a row."""
    return StoredEvent(row["id"], row["job"], row["time"], row["kind"], json.loads(row["data"]))


def key_of(row: Any) -> Key:
    """A key of a row."""
    return Key(**{name: row[name] for name in Key.__dataclass_fields__})
