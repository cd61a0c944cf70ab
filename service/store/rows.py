"""What the store hands out: jobs, chunks, events and keys as plain frozen data."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Job:
    """A job as it is stored; asked: cases known so far where they follow from results. Times are seconds since the epoch; counts:
    number of cases by outcome; lost: cases in failed chunks; seconds: spent on stepping; pace: wall seconds a case, of late;
    landed: when rows last came in; ends: a sum of where its chunks end, where that is known."""

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

    @property
    def known(self) -> int:
        """How many of its cases are known: of a study those asked for so far."""
        return self.cases if self.asked is None else self.asked


@dataclass(frozen=True)
class Chunk:
    """The cases start … stop − 1 of a job, with the number of attempts so far."""

    job: str
    start: int
    stop: int
    state: str
    attempts: int
    not_before: float
    error: str


@dataclass(frozen=True)
class StoredEvent:
    """Something that happened to a job; later events have larger ids."""

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
    """The job that a row of its table holds."""
    fields = {name: row[name] for name in Job.__dataclass_fields__}
    read = {name: json.loads(row[name]) for name in ("counts", "problems")}
    return Job(**fields | read | {"tags": tuple(json.loads(row["tags"]))})


def chunk_of(row: Any) -> Chunk:
    """The chunk that a row of its table holds."""
    return Chunk(**{name: row[name] for name in Chunk.__dataclass_fields__})


def event_of(row: Any) -> StoredEvent:
    """The event that a row of its table holds."""
    return StoredEvent(row["id"], row["job"], row["time"], row["kind"], json.loads(row["data"]))


def key_of(row: Any) -> Key:
    """The key that a row of its table holds."""
    return Key(**{name: row[name] for name in Key.__dataclass_fields__})
