"""The OpenAPI document is complete and correct. For any request, the document describes the answer, and the answer is never a
server error."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis.errors import Unsatisfiable

from tests.analysis.fits.closed_form_motions import GLIDER, QD, TIME, X, noisy
from tests.service.http_servers import MU, SMALL, InProcess, Served


def checks() -> list[Any]:
    """The checks of every answer. (Importing Schemathesis takes a second, so only these tests import it.)"""
    from schemathesis.checks import not_a_server_error
    from schemathesis.specs.openapi import checks

    conformance = ("status_code", "content_type", "response_headers", "response_schema")
    return [not_a_server_error, *(getattr(checks, f"{what}_conformance") for what in conformance)]


@pytest.fixture(scope="module")
def job(bounded: Served) -> str:
    """An existing job with indices and rows. Without a job, requests about jobs would always get "not found"."""
    sample = {"ranges": {MU: [0.1, 0.6]}, "count": 32, "method": "saltelli"}
    there = bounded.submit(SMALL | {"vary": None, "sample": sample, "trajectories": ["ball.q[1]"], "spacing": 0.1})
    bounded.ended(there)
    return there


@pytest.fixture(scope="module")
def study(bounded: Served) -> str:
    """A study that has an answer, as a job."""
    there = bounded.submit(SMALL | {"vary": None, "refine": {"bounds": {MU: [0.1, 0.6]}, "cases": 20}})
    bounded.ended(there)
    return there


@pytest.fixture(scope="module")
def fit(bounded: Served) -> str:
    """A fit, as a job."""
    run = {"time": (TIME / 4).tolist(), "curves": {X: noisy(1).tolist()}}
    there = bounded.submit({"scene": GLIDER, "fit": {"parameters": [QD], "runs": [run]}, "rtol": 1e-6})
    bounded.ended(there)
    return there


@pytest.fixture(scope="module")
def api_schema(bounded: Served) -> Any:
    import schemathesis

    return schemathesis.openapi.from_url(f"http://127.0.0.1:{bounded.port}/openapi.json")


COSTLY = {"fmus": 5, "module": 5, "run": 60, "sensitivities": 20, "animation": 10, "trajectory": 20}
"""Largest number of requests that take seconds, because they need a compiler or a run."""


def tried(schema: Any, examples: int, *jobs: str) -> list[str]:
    """Send right and wrong requests to every operation. Requests about a job are also sent for an existing job. Returns the defects
    of the answers."""
    from schemathesis import GenerationMode

    wrong: list[str] = []
    everything = [found.ok() for found in schema.get_all_operations()]
    # deletions come last, because they remove the jobs
    for operation in sorted(everything, key=lambda o: o.method.upper() == "DELETE"):
        for mode in GenerationMode.POSITIVE, GenerationMode.NEGATIVE:
            for real in ("", *jobs) if "{job}" in operation.path else ("",):
                try:
                    one(operation, mode, min(examples, COSTLY.get(operation.path.rpartition("/")[2], examples)), real)
                except Unsatisfiable:  # this operation has no request of this kind
                    continue
                except (Exception, BaseExceptionGroup) as e:  # noqa: BLE001  # all operations are tried before defects are reported
                    wrong.append(f"{operation.label}: {e}")
    return wrong


def one(operation: Any, mode: Any, examples: int, job: str) -> None:
    """Send many requests to one operation. Unless ``job`` is "", the requests concern this job."""

    held_to = checks()

    @given(case=operation.as_strategy(generation_mode=mode))
    @settings(max_examples=examples, deadline=None, suppress_health_check=list(HealthCheck), database=None, derandomize=True)
    def sent(case: Any) -> None:
        if job:
            case.path_parameters["job"] = job
        case.call_and_validate(checks=held_to, timeout=60)

    sent()


def test_every_answer_is_one_the_document_describes(api_schema: Any, job: str) -> None:
    assert tried(api_schema, 1, job) == []


@pytest.mark.slow
def test_every_one_of_ten_thousand_answers_is_one_the_document_describes(
    api_schema: Any, job: str, study: str, fit: str, bounded: Served
) -> None:
    """``python -m pytest tests/service/api/test_openapi.py -m slow -n 0 -s`` prints the number of requests by operation, and the
    findings."""
    before, wrong = requests(bounded), tried(api_schema, 130, job, study, fit)
    sent = requests(bounded) - before
    print(f"\n{sent} requests, {len(wrong)} findings")
    print("\n".join(wrong))
    assert wrong == []
    assert sent >= 10_000


def requests(s: Served) -> int:
    """Number of requests that a server has answered."""
    lines = [x for x in s.get("/metrics").text.splitlines() if x.startswith("trunnion_requests_total")]
    return round(sum(float(x.rpartition(" ")[2]) for x in lines))


def test_every_operation_has_words_and_every_body_an_example(bounded: Served) -> None:
    document = bounded.get("/openapi.json").json()
    for path, item in document["paths"].items():
        for method, operation in item.items():
            assert operation.get("description") or operation.get("summary"), (method, path)
            for status, answer in operation["responses"].items():
                assert int(status) < 400 or "application/problem+json" in answer["content"] or path == "/readyz", (path, status)
            if "requestBody" in operation:
                assert operation["requestBody"]["content"]["application/json"]["examples"], path


OPERATIONS = (
    "submit_job list_jobs check_job get_job mark_job cancel_job rerun_job extend_job get_job_request list_job_attempts follow_job "
    "get_job_results get_job_trajectories get_job_indices get_job_spreads get_job_answer get_case_trajectory get_case_animation "
    "get_case_events get_job_bins get_job_scene list_models get_model get_scene_schema check_scene view_scene run_scene export_fmu "
    "compute_sensitivities get_usage list_audit make_key list_keys revoke_key get_health get_readiness get_metrics"
)
"""Operations whose names generated clients use: none may be renamed."""


def test_operations_keep_names_of_a_verb_and_an_object(bounded: Served) -> None:
    document = bounded.get("/openapi.json").json()
    names = [o["operationId"] for item in document["paths"].values() for o in item.values()]
    assert set(OPERATIONS.split()) <= set(names)
    assert len(set(names)) == len(names)
    assert all("_" in name for name in names)


def examples(document: dict[str, Any], path: str) -> list[dict[str, Any]]:
    body = document["paths"][path]["post"]["requestBody"]["content"]["application/json"]
    return [e["value"] for e in body["examples"].values()]


def test_the_examples_are_accepted(server: InProcess) -> None:
    document = server.get("/openapi.json").json()
    for path in ("/v1/jobs/check", "/v1/scenes/check", "/v1/keys", "/v1/sensitivities"):
        for example in examples(document, path):
            answer = server.post(path, example)
            assert answer.status_code in (200, 201), (path, example, answer.text)
    assert examples(document, "/v1/jobs") == examples(document, "/v1/jobs/check")
