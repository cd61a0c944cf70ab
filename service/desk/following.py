"""Jobs that follow from others: failed cases again, more cases of the same."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydantic import Field, create_model

from engine.basics.problems import Problem, SceneError
from engine.batch.cases import Cases
from service.desk.tasks import kept_of, read, task, understood
from service.request import (
    Asked,
    JobRequest,
    Plain,
    plan_of_document,
    plan_of_request,
)
from service.settings import Limits

MOST = 100_000
"""Cases that may be listed one by one."""
WAYS = ("over", "cases", "sample")
STUDIES = ("optimise", "refine", "fit")
OTHERS = ("rtol", "method", "kernel", "patience", "steps", "budget", "label", "tags", "notify")
"""What may be another in a job that follows."""


def _fields(*names: str) -> Any:
    """Fields of a job's request; those that are not given stay as they were."""
    whole = JobRequest.model_fields
    return {n: (whole[n].annotation | None, Field(None, description=whole[n].description)) for n in names}  # type: ignore[operator]


class AgainRequest(create_model("Others", __base__=Asked, **_fields(*OTHERS))):  # type: ignore[misc]
    """Which cases to run again, and what is to be another; by default, all that did not end as ``done``, with settings as they
    were."""

    outcomes: list[Plain] | None = Field(None, max_length=50, description="Only cases with these outcomes, or lost.")


class MoreRequest(create_model("More", __base__=Asked, **_fields(*WAYS, *OTHERS))):  # type: ignore[misc]
    """More cases of the same scene: exactly one of ``over``, ``cases`` and ``sample``."""


@task
def which(body: bytes, media: str, limits: Limits) -> list[str] | None:
    """The outcomes of the cases that are to be run again; None: all but ``done``."""
    found: list[str] | None = read(AgainRequest, body, media).outcomes
    return found


@task
def plan_again(body: bytes, media: str, limits: Limits, document: dict[str, Any], numbers: list[int]) -> dict[str, Any]:
    """A job of some cases of another."""
    asked = read(AgainRequest, body, media).model_dump(mode="json", exclude_none=True, exclude={"outcomes"})
    _no_study(document)
    return _listed(document, asked, plan_of_document(document).cases, numbers, limits)


@task
def plan_more(body: bytes, media: str, limits: Limits, document: dict[str, Any]) -> dict[str, Any]:
    """A job of more cases of another's scene, without those that the other has."""
    asked = read(MoreRequest, body, media).model_dump(mode="json", exclude_none=True)
    _no_study(document)
    given = {k: asked.pop(k) for k in WAYS if k in asked}
    more = plan_of_request(understood(JobRequest, _without_ways(document) | asked | given), limits).cases
    there = plan_of_document(document).cases
    new = _not_in(more, there) if set(more.paths) == set(there.paths) else np.arange(more.count)
    if not len(new):
        raise SceneError([Problem("over", "all these cases are there already", "give others")])
    return _listed(document, asked, more, new.tolist(), limits)


def _no_study(document: dict[str, Any]) -> None:
    """Refuse jobs whose cases follow from each other, or are fits."""
    if any(document.get(name) for name in STUDIES):
        what = "the cases of this job are fits" if document.get("fit") else "the cases of this job follow from each other"
        raise SceneError([Problem("job", what, "submit its request again, with more cases or other settings")])


def _not_in(more: Cases, there: Cases) -> np.ndarray:
    """The numbers of the cases that are not among others over the same paths."""
    order = [more.paths.index(p) for p in there.paths]
    old = set(map(tuple, there.values(0, there.count).tolist()))
    values = more.values(0, more.count)[:, order].tolist()
    return np.array([i for i, v in enumerate(values) if tuple(v) not in old], int)


def _without_ways(document: dict[str, Any]) -> dict[str, Any]:
    """A job's request without its cases and its own names."""
    return {k: v for k, v in document.items() if k not in (*WAYS, "label", "tags", "notify")}


def _listed(document: dict[str, Any], asked: dict[str, Any], of: Cases, numbers: list[int], limits: Limits) -> dict[str, Any]:
    """A job of some cases, listed."""
    if len(numbers) > MOST:
        what = f"{len(numbers)} cases are more than the {MOST} that can be listed"
        raise SceneError([Problem("cases", what, "submit a job of its own for them")])
    return kept_of(understood(JobRequest, _without_ways(document) | asked | {"cases": [of.changes(i) for i in numbers]}), limits)
