"""REST, client and page answer queries about samples as ``trunnion.sweep`` and the command do."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest

import trunnion
from tests.batch.test_sobol_indices import known
from tests.service.http_servers import MU, PATIENCE, SMALL, InProcess, Served, as_stored
from tests.service.page.chromium_tab import browser, page, picture, show, tab, until, vary
from trunnion.batch.sample_statistics.result_queries import indices_of, spreads_of
from trunnion.cli import main
from trunnion.service.api.job_data.job_rows import job_contents, result_rows
from trunnion.service.api.routes import indices_spreads_answer
from trunnion.service.client.remote_jobs import Job, connect

__all__ = ["browser", "page", "tab"]
TRAVEL = "final:guide.q[1]"
RANGES = {"joints.guide.friction.mu": "normal(0.1, 0.01)", "joints.guide.friction.half_length": [0.25, 0.35],
          "joints.guide.friction.radius": "triangular(40 mm, 50 mm, 60 mm)"}  # fmt: skip
RUN: dict[str, Any] = {"until": 0.5, "every": 0.05}


@pytest.fixture(scope="module")
def job(served: Served) -> Job:
    """A job with a crossed sample of example 8.3's guide, after its end."""
    there = connect(str(served.client.base_url))
    sample = {"ranges": RANGES, "count": 32, "seed": 4, "method": "saltelli"}
    return there.submit("double_pendulum", sample=sample, reductions=TRAVEL, label="guide", **RUN).wait(timeout=PATIENCE)


@pytest.fixture(scope="module")
def whole() -> Any:
    """The same sample, computed in this process."""
    return trunnion.sweep("double_pendulum", sample=RANGES, count=32, seed=4, sampling="saltelli", reductions=TRAVEL, **RUN)


@pytest.mark.slow
def test_command_rest_and_client_give_the_indices_of_the_function(job: Job, whole: Any, capsys: pytest.CaptureFixture[str]) -> None:
    expected = [i.document() for i in whole.indices()]
    assert job.to_arrow().to_pylist() == as_stored(whole.table).to_pylist()
    assert job.indices() == job.indices(TRAVEL) == expected
    ranges = [f"{p}={v if isinstance(v, str) else f'{v[0]}:{v[1]}'}" for p, v in RANGES.items()]
    words = ["sweep", "double_pendulum", *(w for r in ranges for w in ("--sample", r)), "--count", "32", "--seed", "4",
             "--sampling", "saltelli", "--reduce", TRAVEL, *(w for k, v in RUN.items() for w in (f"--{k}", str(v)))]  # fmt: skip
    assert main([*words, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["indices"] == expected


def test_quantiles_and_exceedance_are_those_of_the_function(job: Job, whole: Any, served: Served) -> None:
    asked: dict[str, Any] = {"at": [0.1, 0.9], "above": {TRAVEL: ["4.5 m", 4.6]}}
    assert job.spreads(**asked) == [s.document() for s in whole.spreads((), **asked)]
    assert [q["probability"] for q in job.spreads(TRAVEL)[0]["quantiles"]] == [0.05, 0.5, 0.95]
    assert served.get(f"/v1/jobs/{job.id}/spreads").json()["complete"] is True


@pytest.mark.parametrize(
    ("place", "asked", "where"),
    [("indices", {"of": "max:x"}, "of"), ("spreads", {"at": 2}, "at"), ("spreads", {"above": "nothing"}, "of"),
     ("spreads", {"above": f"{TRAVEL}=3 kg"}, f"above.{TRAVEL}")],
)  # fmt: skip
def test_questions_that_mean_nothing_are_problems(job: Job, served: Served, place: str, asked: dict[str, Any], where: str) -> None:
    answer = served.get(f"/v1/jobs/{job.id}/{place}", params=asked)
    assert (answer.status_code, where in [p["where"] for p in answer.json()["problems"]]) == (422, True), answer.text


def test_a_job_that_is_not_a_sample_has_neither_indices_nor_quantiles(served: Served) -> None:
    job = served.submit(SMALL | {"vary": {MU: [0.1, 0.2]}})
    served.ended(job)
    for place in ("indices", "spreads"):
        assert served.get(f"/v1/jobs/{job}/{place}").status_code == 422
    assert served.get(f"/v1/jobs/{'0' * 24}/indices").status_code == 404
    wrong = SMALL | {"vary": None, "sample": {"ranges": {MU: "gauss(1)"}, "count": 8, "method": "saltelli"}}
    told = served.post("/v1/jobs", wrong)
    assert {p["where"] for p in told.json()["problems"]} == {f"sample.{MU}", "sample.count"}


def assert_shown(page: Any, expected: dict[str, Any]) -> None:
    """Check that the page shows these indices with their intervals, and draws them."""
    rows = page.evaluate(
        "[...document.querySelectorAll('#answers tbody tr')].map((row) => [...row.children].map((x) => x.textContent.trim()))"
    )
    wanted = [
        (f"{e['path']}, {how}", e)
        for kind, how in (("first", "alone (first)"), ("total", "with all others (total)"))
        for e in expected[kind]
    ]
    texts = page.evaluate(
        "(values) => import('/page/basics/requests_and_dom.js').then((m) => values.map(m.number))",
        [e[n] for _, e in wanted for n in ("value", "low", "high")],
    )
    assert rows[: len(wanted)] == [
        [what, texts[3 * i], f"{texts[3 * i + 1]} to {texts[3 * i + 2]}"] for i, (what, _) in enumerate(wanted)
    ]
    bars = page.evaluate("() => document.getElementById('indexplot').data.map((t) => t.x)")
    assert bars == [[e["value"] for e in expected[kind]] for kind in ("first", "total", "second")]


ISHIGAMI = """
name: ishigami
gravity: [0, 0, 0]
parameters: {first: 0, second: 0, third: 0}
bodies: {block: {box: [1, 1, 1], mass: 1}}
joints:
  slide:
    {type: prismatic, axis: x, inboard: ground, outboard: block,
     start: {q: "{(sin(first) + 7*sin(second)^2 + 0.1*third^4*sin(first)) * 1 m}"}}
"""
"""A block that rests at the value of Ishigami's function."""


@pytest.mark.slow
def test_a_function_whose_indices_are_known_has_them_from_command_rest_and_page_alike(
    served: Served, page: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "ishigami.yaml").write_text(ISHIGAMI)
    ends, of = [-np.pi, np.pi], "final:slide.q[1]"
    ranges = {f"parameters.{n}": ends for n in ("first", "second", "third")}
    words = [w for path in ranges for w in ("--sample", f"{path}={ends[0]!r}:{ends[1]!r}")]
    more = ["--count", "256", "--sampling", "saltelli", "--reduce", of, "--until", "0.001", "--json"]
    assert main(["sweep", str(tmp_path / "ishigami.yaml"), *words, *more]) == 0
    (told,) = json.loads(capsys.readouterr().out)["indices"]
    each = [told[kind][k] for kind in ("first", "total", "second") for k in range(3)]
    assert all(e["low"] <= true <= e["high"] for e, true in zip(each, known(), strict=True))
    sample = {"ranges": ranges, "count": 256, "method": "saltelli"}
    job = served.submit({"scene_text": ISHIGAMI, "sample": sample, "reductions": [of], "until": 0.001})
    served.ended(job)
    assert served.get(f"/v1/jobs/{job}/indices").json()["indices"] == [told]
    show(page, f"/jobs/{job}")
    page.wait_for_selector("#indexplot .bars .point", state="attached")
    assert_shown(page, told)


@pytest.mark.slow
def test_the_page_asks_for_a_crossed_sample_and_draws_what_it_says(page: Any, job: Job) -> None:
    show(page, f"/jobs/{job.id}")
    page.wait_for_selector("#indexplot .bars .point", state="attached")
    expected = job.indices()[0]
    assert_shown(page, expected)
    page.fill("#bound", "4.5")
    page.wait_for_selector("#answers tr:has-text('probability')", state="attached")
    counted = page.evaluate("() => document.getElementById('spreadplot').data[0].y.reduce((a, b) => a + b)")
    assert counted == sum(v is not None for v in job.to_arrow()[expected["of"]].to_pylist())
    picture(page, "sample")
    show(page, "/")
    page.wait_for_selector("#jobverdict.good")
    page.check("input[value=sample]")
    page.select_option("#method", "saltelli")
    page.fill("#samplecount", "32")
    vary(page, "normal(0.3, 0.02)")
    until(page, "document.getElementById('jobverdict').textContent.includes('128 cases')")
    vary(page, "gauss(0.3, 0.02)")
    until(page, "document.getElementById('jobverdict').textContent.includes('not a distribution')")


def test_a_very_large_job_is_answered_from_its_first_cases(server: InProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    sample = {"ranges": {"joints.guide.friction.mu": [0.05, 0.6]}, "count": 40, "seed": 3, "method": "saltelli"}
    job = server.submit({"scene": "double_pendulum", "reductions": [TRAVEL], "until": 0.1, "sample": sample})
    assert server.ended(job)["done"] == 160
    monkeypatch.setattr(indices_spreads_answer, "MOST_CASES", 131)
    indices, spreads = (server.get(f"/v1/jobs/{job}/{what}").json() for what in ("indices", "spreads"))
    assert indices["drawn"] == spreads["drawn"] == {"cases": 131, "of": 160}
    there = job_contents(server.service, job).plan
    rows = pa.concat_tables(result_rows(server.service, job, there.schema, 0, 131))
    assert indices["indices"] == [i.document() for i in indices_of(there.cases, there.reductions, rows)]
    assert spreads["spreads"] == [s.document() for s in spreads_of(there.cases, there.reductions, rows)]
    assert indices["indices"][0]["points"] == 131 // 4
