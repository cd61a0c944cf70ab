"""Plans of jobs that are derived from another job. Such a job runs the failed cases again, or more cases of the same scene."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydantic import Field, create_model

from trunnion.basics.errors import Problem, SceneError
from trunnion.basics.renamed_words import OUTCOMES, current
from trunnion.batch.cases.grids_and_samples import Cases
from trunnion.service.basics.server_settings import Limits
from trunnion.service.request_models.job_request import (
    JobRequest,
    PlainText,
    RequestModel,
    current_document,
    plan_of_document,
    plan_of_request,
)
from trunnion.service.request_workers.worker_tasks import read_request, stored_fields, validate_request

MOST = 100_000
"""Largest number of cases that a request can list."""
CASE_SOURCES = ("vary", "cases", "sample")
STUDIES = ("optimise", "refine", "fit")
OTHERS = ("rtol", "method", "kernel", "cpu_limit", "max_steps", "budget", "label", "tags", "notify")
"""Settings that a rerun or an extension can change."""


def _fields(*names: str) -> Any:
    """Definitions of fields of a job's request. All these fields are optional; omitted fields keep the values of the first job."""
    whole = JobRequest.model_fields
    return {n: (whole[n].annotation | None, Field(None, description=whole[n].description)) for n in names}  # type: ignore[operator]


class RerunRequest(create_model("Others", __base__=RequestModel, **_fields(*OTHERS))):  # type: ignore[misc]
    """Cases to run again, and changed settings. By default, all cases that did not end as ``done`` run again with the same
    settings."""

    outcomes: list[PlainText] | None = Field(
        None, max_length=50, description="Only cases with these outcomes, and cases without a result."
    )


class ExtendRequest(create_model("More", __base__=RequestModel, **_fields(*CASE_SOURCES, *OTHERS))):  # type: ignore[misc]
    """More cases of the same scene, by exactly one of ``vary``, ``cases`` and ``sample``."""


def rerun_outcomes(body: bytes, media: str, limits: Limits) -> list[str] | None:
    """The outcomes of the cases to run again; None means all outcomes except ``done``."""
    found: list[str] | None = read_request(RerunRequest, body, media).outcomes
    return found if found is None else [current("outcome", OUTCOMES, name) for name in found]


def plan_rerun(body: bytes, media: str, limits: Limits, document: dict[str, Any], numbers: list[int]) -> dict[str, Any]:
    """The fields of a new job that runs the cases ``numbers`` of another job again."""
    asked = read_request(RerunRequest, body, media).model_dump(mode="json", exclude_none=True, exclude={"outcomes"})
    document = current_document(document)
    _refuse_study(document)
    return _listed_cases(document, asked, plan_of_document(document).cases, numbers, limits)


def plan_extension(body: bytes, media: str, limits: Limits, document: dict[str, Any]) -> dict[str, Any]:
    """The fields of a new job with more cases of another job's scene, without the cases of that job."""
    asked = read_request(ExtendRequest, body, media).model_dump(mode="json", exclude_none=True)
    document = current_document(document)
    _refuse_study(document)
    given = {k: asked.pop(k) for k in CASE_SOURCES if k in asked}
    if not given:
        raise SceneError([Problem("vary", "no new cases are given", f"give exactly one of {', '.join(CASE_SOURCES)}")])
    more = plan_of_request(validate_request(JobRequest, _without_cases(document) | asked | given), limits).cases
    there = plan_of_document(document).cases
    new = _new_cases(more, there) if set(more.paths) == set(there.paths) else np.arange(more.count)
    if not len(new):
        raise SceneError([Problem("vary", "the job already has all these cases", "give other values")])
    return _listed_cases(document, asked, more, new.tolist(), limits)


def _refuse_study(document: dict[str, Any]) -> None:
    """Raise SceneError for a study or a fit. The cases of a study depend on each other, and a case of a fit is a whole fit."""
    if any(document.get(name) for name in STUDIES):
        what = "this job is a fit" if document.get("fit") else "the cases of this job depend on each other"
        raise SceneError([Problem("job", what, "submit its request again with more cases or other settings")])


def _new_cases(more: Cases, there: Cases) -> np.ndarray:
    """The numbers of the cases in ``more`` that are not in ``there``. ``more`` and ``there`` must vary the same paths."""
    order = [more.paths.index(p) for p in there.paths]
    old = set(map(tuple, there.values(0, there.count).tolist()))
    values = more.values(0, more.count)[:, order].tolist()
    return np.array([i for i, v in enumerate(values) if tuple(v) not in old], int)


def _without_cases(document: dict[str, Any]) -> dict[str, Any]:
    """A job's request without cases, label, tags and notification address."""
    return {k: v for k, v in document.items() if k not in (*CASE_SOURCES, "label", "tags", "notify")}


def _listed_cases(document: dict[str, Any], asked: dict[str, Any], of: Cases, numbers: list[int], limits: Limits) -> dict[str, Any]:
    """The fields of a new job that lists the cases ``numbers`` of ``of``. document: request of the first job. asked: changed
    settings."""
    if len(numbers) > MOST:
        what = f"{len(numbers)} cases are more than the {MOST} that one request can list"
        raise SceneError([Problem("cases", what, "submit a separate job")])
    return stored_fields(
        validate_request(JobRequest, _without_cases(document) | asked | {"cases": [of.changes(i) for i in numbers]}), limits
    )
