"""A further job of a scene reuses what an earlier job made, and its result arrives with the end of its task."""

from __future__ import annotations

import json
import sys
from typing import Any

import pytest
from distributed import Future

from tests.service.http_servers import MU, SMALL, InProcess
from trunnion.basics.errors import SceneError
from trunnion.basics.renamed_words import deprecation_notes
from trunnion.service.basics.server_settings import Limits
from trunnion.service.request_models.job_request import JobRequest, document_of, plan_of_document, plan_of_request
from trunnion.service.request_workers.worker_tasks import plan_job
from trunnion.service.store import job_store, leases_and_chunks
from trunnion.service.store.database_connection import transaction


def test_requests_that_differ_only_in_their_cases_share_a_scene() -> None:
    asked = [JobRequest(**SMALL | {"vary": {MU: [mu]}}) for mu in (0.1, 0.2)]
    made = [plan_of_request(a, Limits()) for a in asked]
    again = [plan_of_document(document_of(a, p)) for a, p in zip(asked, made, strict=True)]
    assert made[0].scene is made[1].scene
    assert again[0].scene is again[1].scene
    assert [p.cases.values(0, 1).tolist() for p in (*made, *again)] == [[[0.1]], [[0.2]]] * 2


@pytest.mark.parametrize("change", [{"until": 0.4}, {"reductions": []}, {"overrides": {MU: 0.3}}])
def test_another_request_shares_no_plan(change: dict[str, Any]) -> None:
    first, other = (plan_of_request(JobRequest(**asked), Limits()) for asked in (SMALL, SMALL | change))
    assert first.scene is not other.scene


def test_a_request_with_a_deprecated_word_gets_its_note_each_time() -> None:
    body = json.dumps(SMALL | {"reductions": ["first:turn"]}).encode()
    for _ in range(2):
        with deprecation_notes() as notes:
            plan_job(body, "application/json", Limits())
        assert len(notes) == 1


def test_plans_are_checked_against_the_limits_of_each_request() -> None:
    asked = JobRequest(**SMALL)
    plan_of_request(asked, Limits())
    with pytest.raises(SceneError, match="bodies are more than"):
        plan_of_request(asked, Limits(bodies=0))


def test_a_job_of_one_case_is_written_in_three_transactions(server: InProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    written = []

    def noted(*given: Any, writing: bool = False) -> Any:
        if writing:
            written.append(sys._getframe(1).f_code.co_name)
        return transaction(*given, writing=writing)

    for module in (job_store, leases_and_chunks):
        monkeypatch.setattr(module, "transaction", noted)
    assert server.ended(server.submit(SMALL | {"vary": {MU: [0.15]}}))["state"] == "done"
    periodic = {"claim", "next_webhook"}  # at fixed intervals, with or without jobs
    assert [name for name in written if name not in periodic] == ["submit", "cut_chunks", "record_last_outcomes"]


def test_a_report_comes_without_a_request(server: InProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*given: Any, **more: Any) -> None:
        raise AssertionError("the result was requested")

    monkeypatch.setattr(Future, "result", refused)
    assert server.ended(server.submit(SMALL))["state"] == "done"
