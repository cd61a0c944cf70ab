"""Answers of the API as documents."""

from __future__ import annotations

import time
from datetime import UTC, datetime
from typing import Any, Literal

from pydantic import BaseModel, Field

from service.api.problems import ProblemItem
from service.store.rows import Job
from service.store.tables import ENDED

State = Literal["queued", "running", "cancelling", "done", "failed", "cancelled"]
EXAMPLE_JOB: dict[str, Any] = {
    "id": "0123456789abcdef01234567",
    "state": "running",
    "stage": "running",
    "scene": "spherical_pendulum",
    "label": "",
    "tags": [],
    "owner": "local",
    "created": "2026-01-01T12:00:00Z",
    "started": "2026-01-01T12:00:00Z",
    "finished": None,
    "cases": 1000,
    "done": 400,
    "lost": 0,
    "outcomes": {"done": 399, "no_solution": 1},
    "progress": 0.4,
    "eta_seconds": 1.5,
    "stepping_seconds": 1.9,
    "build_seconds": 0.0,
    "bytes": 41234,
    "budget": 86400.0,
    "problems": [],
    "links": {
        "self": "/v1/jobs/0123456789abcdef01234567",
        "request": "/v1/jobs/0123456789abcdef01234567/request",
        "results": "/v1/jobs/0123456789abcdef01234567/results",
        "events": "/v1/jobs/0123456789abcdef01234567/events",
    },
}


class JobDocument(BaseModel):
    """A job as clients see it: state, progress, cases by outcome."""

    id: str
    state: State
    stage: str = Field(description="waiting, starting, deriving (its equations), compiling (them), running; at last how it ended.")
    scene: str
    label: str
    tags: list[str]
    owner: str = Field(description="Id of the key that submitted it; local without keys.")
    created: str
    started: str | None
    finished: str | None
    cases: int = Field(description="All cases.")
    done: int = Field(description="Cases with a row in the results, failed runs included.")
    lost: int = Field(description="Cases that could not be run at all (see problems).")
    outcomes: dict[str, int] = Field(description="Rows by outcome.")
    progress: float = Field(ge=0, le=1)
    eta_seconds: float | None = Field(description="Seconds until it is done, as far as can be said.")
    stepping_seconds: float = Field(description="Time spent stepping, all workers together.")
    build_seconds: float
    bytes: int = Field(description="Size of the results as kept.")
    budget: float = Field(description="Seconds of building and stepping allowed.")
    problems: list[ProblemItem]
    links: dict[str, str]

    model_config = {"json_schema_extra": {"examples": [EXAMPLE_JOB]}}


class JobList(BaseModel):
    """A page of jobs, newest first."""

    jobs: list[JobDocument]
    next: str | None = Field(description="Cursor of the next page; null on the last.")


class Attempt(BaseModel):
    """An attempt at a chunk."""

    start: int = Field(description="First case of the chunk.")
    begun: str
    ended: str | None
    worker: str
    result: str = Field(description="done, or what went wrong; empty while it runs.")


def attempt_document(a: dict[str, Any]) -> dict[str, Any]:
    """An attempt as clients see it."""
    return {**{k: a[k] for k in ("start", "worker", "result")}, "begun": stamp(a["begun"]), "ended": stamp(a["ended"])}


def stage_of(j: Job, told: str = "") -> str:
    """Where a job is, in a word. told: what its first worker says that it is at, asked for while there are no rows."""
    if j.state == "queued":
        return "waiting"
    return j.state if j.state != "running" else "running" if j.done else told or "starting"


def job_document(j: Job, told: str = "") -> dict[str, Any]:
    """A job as clients see it. told: as for ``stage_of``."""
    eta = seconds_to_go(j, time.time()) if j.state == "running" else None
    place = f"/v1/jobs/{j.id}"
    return {
        "id": j.id,
        "state": j.state,
        "stage": stage_of(j, told),
        "scene": j.scene,
        "label": j.label,
        "tags": list(j.tags),
        "owner": j.owner,
        "created": stamp(j.created),
        "started": stamp(j.started),
        "finished": stamp(j.finished),
        "cases": j.cases,
        "done": j.done,
        "lost": j.lost,
        "outcomes": j.counts,
        "progress": (j.done + j.lost) / j.cases,
        "eta_seconds": 0.0 if j.state in ENDED else eta,
        "stepping_seconds": j.seconds,
        "build_seconds": j.build_seconds,
        "bytes": j.bytes,
        "budget": j.budget,
        "problems": j.problems,
        "links": {"self": place, "request": f"{place}/request", "results": f"{place}/results", "events": f"{place}/events"},
    }


def seconds_to_go(j: Job, now: float) -> float | None:
    """Seconds until a running job is done, from its pace of late; while nothing comes in (a case that takes its time), as long
    again as nothing has come in. None before anything is known."""
    if not j.pace or j.landed is None:
        return None
    return max(j.pace * (j.cases - j.done - j.lost), now - j.landed)


def stamp(t: float | None) -> str | None:
    """Seconds since the epoch as a date and time of RFC 3339; None stays None."""
    return None if t is None else datetime.fromtimestamp(t, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
