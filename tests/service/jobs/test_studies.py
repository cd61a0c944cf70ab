"""Studies as jobs. Their results determine their cases, as in one process, whichever process is killed."""

from __future__ import annotations

import json
import random
from pathlib import Path
from typing import Any

import pytest

import trunnion
from tests.service.executor.test_failure_recovery import QUICK, children
from tests.service.http_servers import PATIENCE, SMALL, Served, as_stored, eventually
from tests.service.page.chromium_tab import browser, page, picture, show, tab, until, vary
from trunnion.basics.errors import SceneError
from trunnion.cli import main
from trunnion.service.client.remote_jobs import Connection, Job, connect

__all__ = ["browser", "page", "tab"]
MU, C, TRAVEL = "joints.guide.friction.mu", "joints.guide.friction.half_length", "final:guide.q[1]"
BEST: dict[str, Any] = {
    "bounds": {MU: [0.05, 0.5], C: ["100 mm", 0.4]},
    "reach": [TRAVEL, "4 m"],
    "within": {"max:guide.contact[1].normal_force": [None, "20 kN"]},
    "cases": 60,
    "seed": 3,
}
WHERE: dict[str, Any] = {"bounds": {MU: [0.05, 0.9]}, "of": TRAVEL, "cases": 60, "tolerance": 0.01}
RUN: dict[str, Any] = {"until": 0.5, "every": 0.05}


def alone(kind: str, asked: dict[str, Any], **run: Any) -> Any:
    """The same study, computed in this process."""
    given = dict(asked)
    return {"optimise": trunnion.optimise, "refine": trunnion.refine}[kind]("double_pendulum", given.pop("bounds"), **given, **run)


@pytest.fixture(scope="module")
def there(served: Served) -> Connection:
    return connect(str(served.client.base_url))


@pytest.fixture(scope="module")
def best(there: Connection) -> Job:
    """An optimisation, after its end."""
    return there.submit("double_pendulum", optimise=BEST, label="best", **RUN).wait(timeout=PATIENCE)


@pytest.fixture(scope="module")
def where(there: Connection) -> Job:
    """A refinement, after its end."""
    return there.submit("double_pendulum", refine=WHERE, label="where", **RUN).wait(timeout=PATIENCE)


@pytest.mark.parametrize("kind", ["optimise", "refine"])
def test_a_job_asks_for_the_cases_of_the_function_and_finds_what_it_finds(kind: str, request: pytest.FixtureRequest) -> None:
    job = request.getfixturevalue({"optimise": "best", "refine": "where"}[kind])
    whole = alone(kind, {"optimise": BEST, "refine": WHERE}[kind], **RUN)
    assert job.document["state"] == "done"
    assert job.document["cases"] == job.document["done"] == whole.answer["cases"]
    assert job.to_arrow().to_pylist() == as_stored(whole.sweep.table).to_pylist()
    assert job.answer == json.loads(json.dumps(whole.answer))


def test_the_command_finds_the_same(best: Job, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    words = ["optimise", "double_pendulum", "--vary", f"{MU}=0.05:0.5", "--vary", f"{C}=100 mm:0.4", "--reach", f"{TRAVEL}=4 m",
             "--within", "max:guide.contact[1].normal_force=:20 kN", "--cases", "60", "--seed", "3", "--until", "0.5",
             "--every", "0.05", "--plot", str(tmp_path / "best.png")]  # fmt: skip
    assert main([*words, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert {k: told[k] for k in best.answer or {}} == best.answer
    assert (tmp_path / "best.png").stat().st_size > 10_000
    words = ["refine", "double_pendulum", "--vary", f"{MU}=0.05:0.9", "--cases", "60", "--until", "0.5", "--every", "0.05"]
    assert main([*words, "--plot", str(tmp_path / "where.svg"), "-o", str(tmp_path / "t.csv")]) == 0
    assert "done | jammed" in capsys.readouterr().out
    assert "jammed" in (tmp_path / "where.svg").read_text()


def test_single_cases_of_a_study_are_run_again_with_their_own_numbers(best: Job) -> None:
    row = best.to_arrow().to_pylist()[17]
    numbers = {p: row[p] for p in (MU, C)}
    run = trunnion.simulate("double_pendulum", 0.5, 0.05, overrides=numbers, outputs="guide.q[1]", kernel="parts")
    assert best.trajectory(17, "guide.q[1]")["guide.q[1]"].to_pylist() == run["guide.q[1]"].tolist()


def test_requests_that_a_study_cannot_fulfil_are_refused(there: Connection, served: Served, best: Job) -> None:
    with pytest.raises(SceneError, match="depend on each other"):
        best.rerun(["done"])
    with pytest.raises(SceneError, match="depend on each other"):
        best.extend({MU: [0.1]})
    plain = served.submit(SMALL)
    assert served.get(f"/v1/jobs/{plain}/answer").status_code == 409
    wrong: list[tuple[dict[str, Any], str]] = [
        ({"optimise": {"bounds": {MU: [0.5, 0.1]}, "minimise": TRAVEL}}, f"optimise.bounds.{MU}"),
        ({"optimise": {"bounds": {MU: [0.1, 0.5]}}}, "optimise"),
        ({"optimise": {"bounds": {MU: [0.1, 0.5]}, "minimise": "max:*"}}, "optimise"),
        ({"optimise": {"bounds": {MU: [0.1, 0.5]}, "minimise": TRAVEL, "within": {TRAVEL: ["1 kg", None]}}}, f"within.{TRAVEL}"),
        ({"optimise": {"bounds": {"simulation.until": [1, 2]}, "minimise": TRAVEL}}, "optimise.bounds.simulation.until"),
        ({"refine": WHERE, "vary": {MU: [0.1]}}, "vary"),
        ({"refine": WHERE | {"of": "max:nothing"}}, "reductions"),
        ({"refine": WHERE | {"cases": 3}}, "refine.cases"),
    ]
    for body, place in wrong:
        told = served.post("/v1/jobs/check", {"scene": "double_pendulum", **body})
        assert (told.status_code, place in [p["where"] for p in told.json()["problems"]]) == (422, True), told.text


@pytest.mark.slow
def test_the_page_asks_for_studies_and_draws_what_they_found(page: Any, best: Job, where: Job) -> None:
    show(page, f"/jobs/{best.id}")
    page.wait_for_selector("#studyplot .scatterlayer .point", state="attached")
    told = page.locator("#answers").inner_text()
    for path in (MU, C):
        assert path in told
    assert page.input_value("#cases") == str(best.answer["case"])  # the page shows the best case
    picture(page, "best")
    show(page, f"/jobs/{where.id}")
    page.wait_for_selector("#answers td:has-text('jammed')", state="attached")
    picture(page, "where")
    show(page, "/")
    page.select_option("#model", "double_pendulum")
    until(page, "document.querySelector('.path')?.value.includes('friction')")
    page.locator(".path").first.fill(MU)
    page.check("input[value=optimise]")
    page.fill("#goalof", "max:guide.q[1]")
    vary(page, "0.1:0.3")
    page.fill("#within", "max:guide.contact[1].normal_force = :20 kN")
    page.fill("#most", "20")
    page.fill("#until", "0.2")
    until(page, "document.getElementById('jobverdict').textContent.includes('at most 20 cases')")
    page.click("#submit")
    until(page, "document.getElementById('state').textContent.startsWith('done')")
    page.wait_for_selector("#answers tr:has-text('max:guide.q[1]')", state="attached")
    page.click("#edit")
    until(page, "document.getElementById('jobverdict').textContent.includes('at most 20 cases')")
    page.check("input[value=refine]")
    page.fill("#goalof", "outcome")
    until(page, "document.getElementById('jobverdict').textContent.includes('at most 20 cases')")


def test_a_study_that_is_cancelled_reports_how_far_it_has_come(there: Connection) -> None:
    least = {"bounds": BEST["bounds"], "minimise": TRAVEL, "cases": 5000, "tolerance": 1e-9}
    job = there.submit("double_pendulum", optimise=least, **RUN)  # a study needs all its cases
    eventually(lambda: job.refresh().document["done"] > 20)
    job.cancel().wait(timeout=PATIENCE)
    assert (job.state, job.document["cases"]) == ("cancelled", 5000)
    assert job.answer is not None
    assert job.answer["why"] == "not ended yet"


@pytest.mark.slow
@pytest.mark.parametrize("kills", [(12,), pytest.param((10, 40, 80, 100), marks=pytest.mark.slow)])
def test_a_study_whose_server_and_workers_are_killed_asks_for_the_same_cases_bit_for_bit(
    tmp_path: Path, kills: tuple[int, ...]
) -> None:
    chance = random.Random(5)
    most = 60 if len(kills) == 1 else 120
    asked = BEST | {"cases": most}
    with Served(tmp_path / "data", "--workers", "2", *QUICK) as s:
        job = s.submit({"scene": "double_pendulum", "optimise": asked, **RUN})
        for enough in kills:
            eventually(lambda n=enough: s.job(job)["done"] >= n)
            chance.choice(children(s)).kill()
            s.kill()
            s.start()
        end = s.ended(job)
        whole = alone("optimise", asked, **RUN)
        assert (end["state"], end["cases"]) == ("done", most)
        assert s.rows(job) == [list(r.values()) for r in as_stored(whole.sweep.table).to_pylist()]
        assert s.get(f"/v1/jobs/{job}/answer").json()["answer"] == json.loads(json.dumps(whole.answer))
        part = sorted((tmp_path / "data" / "results" / job).glob("part-*.parquet"))[3]
        part.write_bytes(b"spoilt")
        assert s.rows(job) == [list(r.values()) for r in as_stored(whole.sweep.table).to_pylist()]
