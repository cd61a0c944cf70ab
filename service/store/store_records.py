"""Data classes for the records of the store."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import Any, TypeVar

T = TypeVar("T")


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
    tags: list[str] = field(default_factory=list)
    asked: int | None = None
    ends: str = ""


@dataclass(frozen=True)
class Chunk:
    """A chunk: the cases start … stop − 1 of a job. attempts: number of attempts. not_before: earliest time of the next attempt.
    version: version that computed the rows, "" for none."""

    job: str
    start: int
    stop: int
    state: str
    attempts: int
    not_before: float
    error: str
    version: str = ""


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


JSON_FIELDS = ("counts", "problems", "tags", "data")
"""Fields of records that the database tables hold as JSON text."""


def record_of(kind: type[T], row: Any) -> T:
    """The record of a kind in a database row."""
    fields = kind.__dataclass_fields__  # type: ignore[attr-defined]
    return kind(**{name: json.loads(row[name]) if name in JSON_FIELDS else row[name] for name in fields})
