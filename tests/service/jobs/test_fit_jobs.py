"""Fits as jobs find the results of the Python functions to the last bit, whichever process is killed. They stay within budgets and
limits."""

from __future__ import annotations

import json
import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import trunnion
from tests.analysis.fits.closed_form_motions import GLIDER, QD, TIME, Q, X, noisy
from tests.service.executor.test_failure_recovery import QUICK, children
from tests.service.http_servers import PATIENCE, Served, eventually
from tests.service.page.chromium_tab import browser, page, show, tab
from trunnion.basics.errors import SceneError
from trunnion.basics.json_values import finite
from trunnion.cli import main
from trunnion.scene.file_format.yaml_writer import scene_to_dict
from trunnion.scene.overrides import scene_given
from trunnion.service.api.documents.fit_and_study_answers import StudyAnswer
from trunnion.service.basics.server_settings import Limits
from trunnion.service.client.remote_jobs import Connection, Job, connect
from trunnion.service.request_models.job_request import JobRequest, plan_of_document
from trunnion.service.request_workers.worker_tasks import stored_fields, validate_request

__all__ = ["browser", "page", "tab"]
DRAG = "joints.rail.damping"
RUNS = [
    trunnion.MeasuredRun(TIME, {X: noisy(1)}, {}, 0.02, "first"),
    trunnion.MeasuredRun(TIME, {X: noisy(2, q=-0.2)}, {Q: -0.1}, 0.02, "second"),
]
LAWS = {"free": trunnion.Candidate(), "drag": trunnion.Candidate((DRAG,), overrides={DRAG: 0.05})}
TRIALS = {"longer": trunnion.Experiment({}, until=4.0)}
GIVEN: dict[str, Any] = {"runs": RUNS, "own": [Q], "priors": {QD: "normal(0.5, 0.2)"}}
ONE: dict[str, Any] = {"parameters": [QD, Q], "runs": [{"time": TIME.tolist(), "curves": {X: noisy(1).tolist()}}]}


def plain(data: Any) -> Any:
    """Data in JSON form."""
    return json.loads(json.dumps(finite(data)))


@pytest.fixture(scope="module")
def there(served: Served) -> Connection:
    return connect(str(served.client.base_url))


@pytest.fixture(scope="module")
def job(there: Connection) -> Job:
    """A job that compares two laws and an experiment."""
    return there.fit(GLIDER, QD, **GIVEN, candidates=LAWS, trials=TRIALS, label="laws").wait(timeout=PATIENCE)


@pytest.fixture(scope="module")
def evidence() -> trunnion.ModelComparison:
    """The same fits, computed in this process."""
    return trunnion.compare(GLIDER, LAWS, QD, **GIVEN)


def test_a_job_has_the_results_of_the_functions(job: Job, evidence: trunnion.ModelComparison) -> None:
    best = evidence.best.fit
    assert best is not None
    assert (job.state, job.document["cases"], job.document["outcomes"]) == ("done", 2, {"done": 2})
    assert job.answer is not None
    assert job.answer["compared"] == plain(evidence.document())
    assert job.answer["fit"] == plain(best.document())
    assert job.answer["experiments"] == plain([p.document() for p in trunnion.propose(best, TRIALS)])
    assert job.to_arrow(["case", "candidate", "outcome"]).to_pylist() == [
        {"case": i, "candidate": n, "outcome": "done"} for i, n in enumerate(LAWS)
    ]


def test_the_answer_is_what_the_document_of_the_interface_says(job: Job, served: Served) -> None:
    told = served.get(f"/v1/jobs/{job.id}/answer").json()
    assert StudyAnswer.model_validate(told).model_dump(exclude_unset=True) == told


def test_a_repeated_fit_request_has_the_same_answer(there: Connection, job: Job) -> None:
    again = there.submit(**{n: v for n, v in job.request.items() if n != "scene"}, scene=job.request["scene"])
    assert again.wait(timeout=PATIENCE).answer == job.answer
    keyed = [there.fit(GLIDER, QD, TIME, {X: noisy(1)}, idempotency_key="one fit").id for _ in range(2)]
    assert keyed[0] == keyed[1]


def test_the_commands_report_what_the_command_without_a_server_reports(
    served: Served, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("TRUNNION_SERVER", str(served.client.base_url))
    Path("glider.json").write_text(json.dumps(scene_to_dict(scene_given(GLIDER))))
    np.savetxt("a.csv", np.column_stack([TIME, 1e3 * noisy(1)]), delimiter=",", header="time,place (mm)", comments="")
    words = ["glider.json", "--data", "a.csv", "--column", f"{X}=place", "--vary", QD, "--own", Q, "--noise", "20 mm",
             "--compare", "coulomb", "--compare", f"coulomb; {DRAG}~0.05", "--try", f"{QD}=1; until=4 s"]  # fmt: skip
    assert main(["fit", *words]) == 0
    alone = capsys.readouterr().out
    assert main(["jobs", "fit", *words, "--wait", "--label", "by command"]) == 0
    assert capsys.readouterr().out.splitlines()[1:] == alone.splitlines()[1:]
    made = served.get("/v1/jobs", params={"label": "by command"}).json()["jobs"][0]["id"]
    assert main(["jobs", "answer", made]) == 0
    assert capsys.readouterr().out.splitlines()[1:] == alone.splitlines()[1:]
    assert main(["jobs", "answer", made, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["kind"] == "fit"


def test_every_mistake_is_reported_at_once_with_its_place(served: Served) -> None:
    wrong: dict[str, Any] = ONE | {"parameters": [QD, "rail.mu"], "trials": {"t": {"overrides": {"q": 1}}}}
    wrong["runs"] = [*ONE["runs"], {"time": [0.0, 1.0], "curves": {"rail.plaice": [0.0]}, "noise": -1.0}]
    body = {"scene": GLIDER, "fit": wrong, "vary": {QD: [1]}, "until": 3, "certify": True, "budget": 1e9}
    told = served.post("/v1/jobs/check", body)
    assert told.status_code == 422
    assert {p["where"] for p in told.json()["problems"]} == {
        "vary", "until", "certify", "budget", "fit, parameters", "fit, run 2, measured", "fit, run 2, noise", "fit, noise",
        "fit, trial t, q",
    }  # fmt: skip
    broken = {"scene": GLIDER, "fit": {"runs": [{"time": ["now", 1], "curves": {X: [None]}}], "level": 2}}
    places = {p["where"] for p in served.post("/v1/jobs/check", broken).json()["problems"]}
    assert places == {"fit.runs.0.time.0", f"fit.runs.0.curves.{X}.0", "fit.level"}
    assert served.post("/v1/jobs/check", {"scene": GLIDER, "fit": ONE}).json()["cases"] == 1


@pytest.mark.parametrize(
    ("more", "limits", "where"),
    [
        ({"runs": [{"time": np.linspace(0, 9, 60_000).tolist(), "curves": {X: [0.0] * 60_000, "rail.qd[1]": [0.0] * 60_000}}]},
         Limits(), "fit.runs"),
        ({"own": [Q], "parameters": [QD], "runs": ONE["runs"] * 50}, Limits(), "fit.parameters"),
        ({}, Limits(duration=1.0), "fit.runs.0.time"),
        ({"trials": {"t": {"until": "3 h"}}}, Limits(duration=1000.0), "fit.trials.t.until"),
        ({"trials": {"t": {"until": 1000, "every": "1 ns"}}}, Limits(), "fit, trial t, every"),
        ({"candidates": {str(i): {} for i in range(5)}}, Limits(cases=4), "fit.candidates"),
        ({}, Limits(output_bytes=500), "fit.runs"),
    ],
)  # fmt: skip
def test_a_fit_beyond_the_servers_limits_is_refused(more: dict[str, Any], limits: Limits, where: str) -> None:
    with pytest.raises(SceneError) as e:
        stored_fields(validate_request(JobRequest, {"scene": GLIDER, "fit": ONE | more}), limits)
    assert where in [p.where for p in e.value.problems]


def test_the_document_that_is_kept_means_the_same_for_ever() -> None:
    kept = stored_fields(validate_request(JobRequest, {"scene": GLIDER, "fit": ONE, "rtol": "1e-7"}), Limits())
    plan = plan_of_document(json.loads(kept["document"]))
    assert (plan.request.rtol, plan.cases.count, kept["cases"]) == (1e-7, 1, 1)  # type: ignore[attr-defined]


def test_operations_without_meaning_for_a_fit_are_refused(job: Job, served: Served) -> None:
    for what in (lambda: job.rerun(["done"]), lambda: job.extend({QD: [0.1]})):
        with pytest.raises(SceneError, match="is a fit"):
            what()
    told = served.get(f"/v1/jobs/{job.id}/cases/0/trajectory")
    assert (told.status_code, "submit the fitted values" in told.json()["detail"]) == (409, True)
    assert served.get(f"/v1/jobs/{job.id}/bins", params={"x": "steps"}).json()["cases"] == 2


@pytest.mark.slow
def test_the_page_reports_what_was_found(page: Any, job: Job) -> None:
    show(page, f"/jobs/{job.id}")
    page.wait_for_selector("#answers tr:has-text('longer')", state="attached")
    assert job.answer is not None
    told = page.locator("#answers").inner_text()
    for name in (*job.answer["fit"]["values"], *LAWS, "would tell"):
        assert name in told
    assert [page.locator(f"#{x}").is_visible() for x in ("over", "closer", "edit", "rerun")] == [False] * 4
    assert page.inner_text("#state").startswith("done: 2 of 2")


def slow(count: int, until: float = 3.0) -> dict[str, Any]:
    """Fits that take some time: many laws for the measured swing of a pendulum up to ``until``, s."""
    from tests.benchmarks.numerical_error.fit_interval_coverage import MU, PENDULUM

    time = np.arange(0.0, until + 0.01, 0.05)
    swing = 0.3 * np.exp(-time) * np.cos(5 * time)
    candidates = {f"{i}": {"overrides": {MU: 0.2 + 0.01 * i}} for i in range(count)}
    run = {"time": time.tolist(), "curves": {"pivot.q[1]": swing.tolist()}}
    fit = {"parameters": [MU, "joints.pivot.damping"], "runs": [run], "candidates": candidates}
    return {"scene": PENDULUM, "fit": fit}


def test_how_far_a_fit_has_come_is_reported_and_it_ends_when_it_is_cancelled(served: Served) -> None:
    job = served.submit(slow(20))
    eventually(lambda: served.job(job)["stage"].startswith("fitting: ") or served.job(job)["done"])
    served.client.delete(f"/v1/jobs/{job}")
    end = served.ended(job)
    assert end["state"] == "cancelled"
    assert end["done"] < 20
    told = served.get(f"/v1/jobs/{job}/answer").json()
    assert (told["complete"], told["ended"]) == (False, True)


def test_a_fit_that_has_used_up_its_budget_ends_with_this_outcome(served: Served) -> None:
    end = served.ended(served.submit(slow(20) | {"budget": 0.5}))
    assert (end["state"], end["problems"][0]["where"]) == ("failed", "budget")
    assert end["done"] < 20


@pytest.mark.slow
def test_a_fit_whose_server_and_workers_are_killed_is_found_again_to_the_same_bits(tmp_path: Path) -> None:
    asked, chance = slow(2, 1.0), random.Random(5)
    with Served(tmp_path / "data", "--workers", "2", *QUICK) as s:
        job = s.submit(asked)
        eventually(lambda: s.job(job)["stage"].startswith("fitting: interval") or s.job(job)["done"])
        chance.choice(children(s)).kill()
        s.kill()
        s.start()
        eventually(lambda: s.job(job)["done"])
        s.kill()
        s.start()
        end = s.ended(job)
        assert (end["state"], end["outcomes"]) == ("done", {"done": 2})
        found = s.get(f"/v1/jobs/{job}/answer").json()["answer"]
        part = sorted((tmp_path / "data" / "results" / job).glob("part-*.parquet"))[1]
        part.write_bytes(b"spoilt")
        assert s.get(f"/v1/jobs/{job}/answer").json()["answer"] == found
    r = asked["fit"]["runs"][0]
    laws = {n: trunnion.Candidate(overrides=c["overrides"]) for n, c in asked["fit"]["candidates"].items()}
    whole = trunnion.compare(asked["scene"], laws, asked["fit"]["parameters"], np.array(r["time"]), r["curves"])
    assert found["compared"] == plain(whole.document())
