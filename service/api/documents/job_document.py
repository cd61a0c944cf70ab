"""JSON documents of jobs, job lists and attempts."""

from __future__ import annotations

import time
from collections import Counter
from datetime import UTC, datetime
from typing import Any, Literal

from pydantic import BaseModel, Field

from trunnion.basics.control_characters import visible
from trunnion.basics.renamed_words import OUTCOMES
from trunnion.service.api.documents.problem_documents import ProblemItem
from trunnion.service.store.store_records import Job
from trunnion.service.store.table_definitions import ENDED

COPIED = ("id", "state", "owner", "cases", "done", "lost", "build_seconds", "bytes", "budget", "problems")
"""Fields of a job record that the document contains without change."""
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
    stage: str = Field(description="waiting, starting, deriving (equations), compiling, running; finally the end state.")
    scene: str
    label: str
    tags: list[str]
    owner: str = Field(description="Id of the key that submitted the job; `local` on a server without keys.")
    created: str
    started: str | None
    finished: str | None
    cases: int = Field(description="All cases.")
    done: int = Field(description="Cases with a row in the results, including failed runs.")
    lost: int = Field(description="Cases that failed in all attempts (see problems).")
    outcomes: dict[str, int] = Field(description="Rows by outcome.")
    progress: float = Field(ge=0, le=1)
    eta_seconds: float | None = Field(description="Estimated seconds until the job is done.")
    stepping_seconds: float = Field(description="Processor time of the time integration, summed over all workers.")
    build_seconds: float = Field(description="Processor time of building, with compilers, summed over all workers.")
    bytes: int = Field(description="Size of the stored results.")
    budget: float = Field(description="Allowed processor time, s.")
    problems: list[ProblemItem]
    links: dict[str, str]

    model_config = {"json_schema_extra": {"examples": [EXAMPLE_JOB]}}


class JobList(BaseModel):
    """A page of jobs, newest first."""

    jobs: list[JobDocument]
    next: str | None = Field(description="Cursor of the next page; null on the last page.")


class Attempt(BaseModel):
    """An attempt to run a chunk."""

    start: int = Field(description="First case of the chunk.")
    begun: str
    ended: str | None
    worker: str
    result: str = Field(description="done, or the error; empty while the attempt runs.")


def attempt_document(a: dict[str, Any]) -> dict[str, Any]:
    return {**{k: a[k] for k in ("start", "worker", "result")}, "begun": rfc3339(a["begun"]), "ended": rfc3339(a["ended"])}


def stage_of(j: Job, told: str = "") -> str:
    """The stage of a job. told: the stage that the first worker reported. Clients see this stage until the job has rows."""
    if j.state == "queued":
        return "waiting"
    return j.state if j.state != "running" else "running" if j.done else told or "starting"


def job_document(j: Job, told: str = "") -> dict[str, Any]:
    """A job as clients see it. told: as for ``stage_of``."""
    eta = remaining_seconds(j, time.time()) if j.state == "running" else None
    place = f"/v1/jobs/{j.id}"
    return {
        **{name: getattr(j, name) for name in COPIED},
        **{name: visible(getattr(j, name)) for name in ("scene", "label")},
        **{name: rfc3339(getattr(j, name)) for name in ("created", "started")},
        "finished": rfc3339(j.finished) if j.state in ENDED else None,
        "stage": stage_of(j, told),
        "tags": [visible(tag) for tag in j.tags],
        "outcomes": current_counts(j.counts),
        "progress": (j.done + j.lost) / j.cases,
        "eta_seconds": 0.0 if j.state in ENDED else eta,
        "stepping_seconds": j.seconds,
        "links": {"self": place, "request": f"{place}/request", "results": f"{place}/results", "events": f"{place}/events"},
    }


def current_counts(counts: dict[str, int]) -> dict[str, int]:
    """Numbers of cases by outcome. Deprecated names of outcomes are replaced by the current names."""
    found: Counter[str] = Counter()
    for name, n in counts.items():
        found[OUTCOMES.get(name, name)] += n
    return dict(found)


def remaining_seconds(j: Job, now: float) -> float | None:
    """Estimated seconds until a running job is done, computed from the job's recent pace. None before the first rows arrive. The
    estimate is at least the time since the last rows arrived."""
    if not j.pace or j.landed is None:
        return None
    return max(j.pace * (j.cases - j.done - j.lost), now - j.landed)


def rfc3339(t: float | None) -> str | None:
    """A time in seconds since the epoch as RFC 3339 text; None stays None."""
    return None if t is None else datetime.fromtimestamp(t, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
