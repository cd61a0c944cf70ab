"""Records of the store as frozen data."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Job:
    """A stored job. Times are seconds since the epoch. counts: cases by outcome; lost: cases in failed chunks; seconds: stepping;
    pace: recent wall seconds of a case; landed: time of the last rows; asked: known cases of a study; ends: digest of the chunk
    ends, once known."""

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
        """Number of known cases; of a study those requested so far."""
        return self.cases if self.asked is None else self.asked


@dataclass(frozen=True)
class Chunk:
    """The cases start … stop − 1 of a job, with its attempts."""

    job: str
    start: int
    stop: int
    state: str
    attempts: int
    not_before: float
    error: str


@dataclass(frozen=True)
class StoredEvent:
    """An event of a job; ids increase."""

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
    """A job from a row."""
    fields = {name: row[name] for name in Job.__dataclass_fields__}
    read = {name: json.loads(row[name]) for name in ("counts", "problems")}
    return Job(**fields | read | {"tags": tuple(json.loads(row["tags"]))})


def chunk_of(row: Any) -> Chunk:
    """A chunk from a row."""
    return Chunk(**{name: row[name] for name in Chunk.__dataclass_fields__})


def event_of(row: Any) -> StoredEvent:
    """An event from a row."""
    return StoredEvent(row["id"], row["job"], row["time"], row["kind"], json.loads(row["data"]))


def key_of(row: Any) -> Key:
    """A key from a row."""
    return Key(**{name: row[name] for name in Key.__dataclass_fields__})
