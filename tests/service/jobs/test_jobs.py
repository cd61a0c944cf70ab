"""Jobs over REST give the results of ``trunnion.sweep``. These results can be fetched in every format."""

from __future__ import annotations

import io
import json
from typing import Any

import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq
import pytest

import trunnion
from tests.service.http_servers import MU, SMALL, InProcess, as_stored

KEEP = SMALL["reductions"]


@pytest.fixture(scope="module")
def small(server: InProcess) -> str:
    """A job of 40 cases that has ended."""
    job = server.submit(SMALL, headers={"Idempotency-Key": "small"})
    end = server.ended(job)
    assert end["state"] == "done", end
    return job


@pytest.fixture(scope="module")
def expected() -> pa.Table:
    """The result of ``trunnion.sweep`` for the same batch."""
    return as_stored(trunnion.sweep("spherical_pendulum", SMALL["vary"], reductions=KEEP, until=0.5).table)


def test_a_submission_is_accepted_with_its_place_and_the_job_says_how_it_goes(server: InProcess, small: str) -> None:
    answer = server.post("/v1/jobs", SMALL)
    assert answer.status_code == 202
    assert answer.headers["location"] == f"/v1/jobs/{answer.json()['id']}"
    end = server.ended(answer.json()["id"])
    assert (end["done"], end["lost"], end["progress"], end["outcomes"]) == (40, 0, 1.0, {"done": 40})


def test_the_same_idempotency_key_makes_no_second_job(server: InProcess, small: str) -> None:
    again = server.post("/v1/jobs", SMALL, headers={"Idempotency-Key": "small"})
    assert (again.status_code, again.json()["id"]) == (200, small)
    other = server.post("/v1/jobs", SMALL | {"until": 0.6}, headers={"Idempotency-Key": "small"})
    assert other.status_code == 409
    assert other.headers["content-type"] == "application/problem+json"


def test_a_jobs_request_can_be_read_and_submitted_again(server: InProcess, small: str) -> None:
    asked = server.get(f"/v1/jobs/{small}/request").json()
    assert (asked["vary"], asked["until"]) == (SMALL["vary"], SMALL["until"])
    again = server.submit(asked)
    server.ended(again)
    assert server.rows(again) == server.rows(small)


def test_results_are_those_of_engine_sweep_in_every_format(server: InProcess, small: str, expected: pa.Table) -> None:
    place = f"/v1/jobs/{small}/results"
    as_json = server.get(place).json()
    assert [c["name"] for c in as_json["columns"]] == expected.schema.names
    assert as_json["rows"] == [list(r.values()) for r in expected.to_pylist()]
    for kind, read in (
        ("application/vnd.apache.parquet", lambda b: pq.read_table(io.BytesIO(b))),
        ("application/vnd.apache.arrow.stream", lambda b: pa.ipc.open_stream(b).read_all()),
    ):
        answer = server.get(place, headers={"Accept": f"text/html;q=0.9, {kind}"})
        assert answer.headers["content-type"] == kind
        assert answer.headers["trunnion-complete"] == "true"
        assert read(answer.content).to_pylist() == expected.to_pylist()
    answer = server.get(place, headers={"Accept": "text/csv"})
    table = pa.csv.read_csv(io.BytesIO(answer.content))
    assert table.column_names == expected.schema.names
    assert table[KEEP[0]].to_pylist() == expected[KEEP[0]].to_pylist()
    assert server.get(place, headers={"Accept": "image/png"}).status_code == 406
    assert server.get(place, params={"format": "csv"}).headers["content-type"].startswith("text/csv")


def test_some_cases_and_some_columns_can_be_asked_for(server: InProcess, small: str, expected: pa.Table) -> None:
    answer = server.get(f"/v1/jobs/{small}/results", params={"first": 7, "count": 20, "column": ["case", KEEP[0]]}).json()
    assert [r[0] for r in answer["rows"]] == list(range(7, 27))
    assert [r[1] for r in answer["rows"]] == expected[KEEP[0]].to_pylist()[7:27]
    wrong = server.get(f"/v1/jobs/{small}/results", params={"column": "mu"})
    assert (wrong.status_code, wrong.json()["problems"][0]["where"]) == (422, "column")


def test_a_case_can_be_seen_with_all_its_rows(server: InProcess, small: str) -> None:
    answer = server.get(f"/v1/jobs/{small}/cases/5/trajectory", params={"outputs": ["ball.qd[2]"]}).json()
    r = trunnion.simulate("spherical_pendulum", until=0.5, overrides={MU: 0.1 + 5 * 0.5 / 39}, outputs=["ball.qd[2]"])
    assert [c["name"] for c in answer["columns"]] == ["time", "ball.qd[2]"]
    assert len(answer["rows"]) == len(r)
    assert answer["rows"][-1][1] == pytest.approx(float(r["ball.qd[2]"][-1]), rel=1e-12)
    sure = server.get(f"/v1/jobs/{small}/cases/5/trajectory", params={"outputs": ["ball.qd[2]"], "certify": True}).json()
    assert [c["name"] for c in sure["columns"]] == ["time", "ball.qd[2]", "time.error", "ball.qd[2].error"]
    assert [row[:2] for row in sure["rows"]] == answer["rows"]
    assert server.get(f"/v1/jobs/{small}/cases/40/trajectory").status_code == 404
    assert server.get(f"/v1/jobs/{small}/cases/1/trajectory", params={"outputs": "nothing"}).status_code == 422


def test_a_case_can_be_seen_as_a_moving_picture(server: InProcess, small: str) -> None:
    answer = server.get(f"/v1/jobs/{small}/cases/5/animation")
    assert answer.status_code == 200
    assert "canvas" in answer.text


def test_a_failing_case_is_a_row_with_its_diagnosis(server: InProcess) -> None:
    path = "joints.guide.friction.half_length"
    job = server.submit(
        {"scene": "double_pendulum", "cases": [{path: 0.15}, {path: 0.3}, {path: -1}], "reductions": ["count:any"], "until": 0.1}
    )
    end = server.ended(job)
    assert (end["state"], end["outcomes"]) == ("done", {"jammed": 1, "done": 1, "invalid": 1})
    rows = {r[0]: r for r in server.rows(job)}
    assert rows[0][4] == "guide"
    assert path in rows[2][5]


def test_lists_samples_and_yaml_scenes_are_taken(server: InProcess) -> None:
    text = server.get("/v1/models/spherical_pendulum").json()["text"]
    sample = {"ranges": {MU: [0.1, 0.6]}, "count": 12, "seed": 5, "method": "random"}
    job = server.submit({"scene_text": text, "sample": sample, "reductions": KEEP, "until": 0.2})
    assert server.ended(job)["done"] == 12
    whole = trunnion.sweep(
        "spherical_pendulum", sample={MU: (0.1, 0.6)}, count=12, seed=5, sampling="random", reductions=KEEP, until=0.2
    )
    assert server.rows(job) == [list(r.values()) for r in as_stored(whole.table).to_pylist()]


def test_a_scene_without_a_sweep_runs_once(server: InProcess) -> None:
    asked = {k: v for k, v in SMALL.items() if k != "vary"}
    assert server.post("/v1/jobs/check", asked).json()["cases"] == 1
    job = server.submit(asked)
    assert server.ended(job)["done"] == 1
    r = trunnion.simulate("spherical_pendulum", until=0.5, outputs=["ball.contact[1].normal_force"])
    columns = [c["name"] for c in server.get(f"/v1/jobs/{job}/results").json()["columns"]]
    (row,) = server.rows(job)
    assert dict(zip(columns, row, strict=True))[KEEP[0]] == r["ball.contact[1].normal_force"].max()
    assert server.get(f"/v1/jobs/{job}/cases/0/trajectory").status_code == 200
    again = server.post(f"/v1/jobs/{job}/rerun", {"outcomes": ["done"]})
    assert (again.status_code, again.json()["cases"]) == (202, 1)
    both = server.post("/v1/jobs/check", SMALL | {"cases": [{MU: 0.1}]})
    assert both.status_code == 422


def test_a_cancelled_job_keeps_the_rows_it_has(server: InProcess) -> None:
    job = server.submit(SMALL | {"vary": {MU: "0.1:0.6:5000"}, "until": 1000.0, "every": 0.01})
    assert server.client.delete(f"/v1/jobs/{job}").status_code == 200
    end = server.ended(job)
    assert end["state"] == "cancelled"
    assert len(server.rows(job)) == end["done"] < 5000
    assert server.client.delete(f"/v1/jobs/{job}").json()["state"] == "cancelled"


def test_a_job_stops_when_its_time_budget_is_used_up(server: InProcess) -> None:
    job = server.submit(SMALL | {"vary": {MU: "0.1:0.6:5000"}, "until": 1000.0, "every": 0.01, "budget": 0.2})
    end = server.ended(job)
    assert (end["state"], end["problems"][0]["where"]) == ("failed", "budget")


def test_the_events_of_a_job_list_its_states(server: InProcess, small: str) -> None:
    with server.client.stream("GET", f"/v1/jobs/{small}/events") as answer:
        assert answer.headers["content-type"].startswith("text/event-stream")
        lines = [x for x in answer.iter_lines() if x]
    kinds = [x.split(": ")[1] for x in lines if x.startswith("event")]
    assert (kinds[0], "started" in kinds, "progress" in kinds, "done" in kinds) == ("submitted", True, True, True)
    ids = [x.split(": ")[1] for x in lines if x.startswith("id")]
    with server.client.stream("GET", f"/v1/jobs/{small}/events", headers={"Last-Event-ID": ids[0]}) as answer:
        assert "submitted" not in answer.read().decode()


def test_the_list_of_jobs_is_paged_and_filtered(server: InProcess, small: str) -> None:
    server.submit(SMALL | {"label": "mine", "until": 0.01})
    assert [j["label"] for j in server.get("/v1/jobs", params={"label": "mine"}).json()["jobs"]] == ["mine"]
    page = server.get("/v1/jobs", params={"limit": 1}).json()
    assert len(page["jobs"]) == 1
    assert server.get("/v1/jobs", params={"limit": 1, "cursor": page["next"]}).json()["jobs"][0]["id"] != page["jobs"][0]["id"]
    assert server.get("/v1/jobs", params={"cursor": "?"}).status_code == 422


WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "no scene": ({"vary": {MU: [1]}}, "scene"),
    "a file's name": ({"scene": "/etc/passwd", "vary": {MU: [1]}}, "scene"),
    "an address": ({"scene": "http://127.0.0.1/x.yaml", "vary": {MU: [1]}}, "scene"),
    "a scene with mistakes": ({"scene": {"schema": 1, "bodies": {"a": {"mass": -1}}}, "vary": {MU: [1]}}, "bodies.a.mass"),
    "a path that leads nowhere": (SMALL | {"vary": {"joints.ball.friction.nu": [1]}}, "vary.joints.ball.friction.nu"),
    "too many cases": (SMALL | {"vary": {MU: "0:1:100000"}}, "cases"),
    "two ways at once": (SMALL | {"cases": [{MU: 1}]}, "vary"),
    "an unknown field": (SMALL | {"untill": 3}, "untill"),
    "a run too long": (SMALL | {"until": 1e9}, "until"),
    "too many rows": (SMALL | {"until": 1e4, "every": 1e-6}, "every"),
    "an unknown reduction": (SMALL | {"reductions": ["max:nothing"]}, "reductions"),
    "too large a budget": (SMALL | {"budget": 1e9}, "budget"),
}


@pytest.mark.parametrize("name", WRONG)
def test_mistakes_in_a_request_are_reported_as_a_problem_document(server: InProcess, name: str) -> None:
    body, where = WRONG[name]
    answer = server.post("/v1/jobs", body)
    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"
    assert where in [p["where"] for p in answer.json()["problems"]], answer.json()


def test_rest_reports_the_same_problems_as_the_command_line(
    server: InProcess, capsys: pytest.CaptureFixture[str], tmp_path: Any
) -> None:
    from trunnion.cli import main

    text = "schema: 1\nbodies:\n  a: {mass: -1}\njoints:\n  j: {type: revolut, inboard: ground, outboard: a}\n"
    (tmp_path / "x.yaml").write_text(text)
    assert main(["check", str(tmp_path / "x.yaml"), "--json"]) == 2
    told = [{k: v for k, v in p.items() if k != "file"} for p in json.loads(capsys.readouterr().out)["problems"]]
    got = server.post("/v1/scenes/check", {"scene_text": text}).json()["problems"]
    assert [{k: v for k, v in p.items() if k != "file"} for p in got] == told
    assert len(told) > 1


@pytest.mark.parametrize("body", [b"", b"{", b"[]", b"null", b"\xff\xfe", b'{"scene": 1e999}', b"[" * 100_000])
def test_bodies_that_are_no_json_are_refused(server: InProcess, body: bytes) -> None:
    answer = server.client.post("/v1/jobs", content=body, headers={"content-type": "application/json"})
    assert answer.status_code in (400, 422)
    assert answer.headers["content-type"] == "application/problem+json"


def test_a_body_too_large_is_refused_also_when_its_size_is_not_told(server: InProcess) -> None:
    def pieces() -> Any:
        yield from [b" " * 10_000] * 30

    assert server.client.post("/v1/jobs", content=b" " * 300_000).status_code == 413
    assert server.client.post("/v1/jobs", content=pieces(), headers={"content-type": "application/json"}).status_code == 413


def test_a_scene_is_checked_as_it_is_typed(server: InProcess) -> None:
    facts = server.post("/v1/scenes/check", {"scene": "spherical_pendulum"}).json()
    assert MU in [p["path"] for p in facts["parameters"]]
    assert "ball.contact[1].normal_force" in [c["name"] for c in facts["columns"]]


def test_a_scene_that_is_sent_reads_no_files_of_the_server(server: InProcess, tmp_path, monkeypatch) -> None:
    (tmp_path / "part.yaml").write_text("bodies: {secret: {sphere: 1, mass: 1}}")
    monkeypatch.chdir(tmp_path)
    rest = {"bodies": {"b": {"sphere": 1, "mass": 1}}, "joints": {"j": {"type": "free", "inboard": "ground", "outboard": "b"}}}
    named: list[dict] = [{"include": "part.yaml"}, {"include": [str(tmp_path / "part.yaml")]}]
    named.append({"assemblies": {"a": {"use": "part.yaml"}}})
    for more in named:
        for body in ({"scene": rest | more}, {"scene_text": json.dumps(rest | more)}):
            answer = server.post("/v1/scenes/check", body)
            assert answer.status_code == 422
            assert "trunnion check FILE -o whole.yaml" in answer.text
            assert "secret" not in answer.text
    row = {"use": rest, "copies": {"line": {"times": 2, "step": [1, 0, 0]}}}
    inside = {"scene": {"assemblies": {"a": row}, "parameters": {"size": "2 m"}}}
    facts = server.post("/v1/scenes/check", inside).json()
    assert facts["bodies"] == ["a1_b", "a2_b"]
    assert ("parameters.size", 2.0, "m") in [(p["path"], p["value"], p["unit"]) for p in facts["parameters"]]


def test_models_and_the_format_are_reported(server: InProcess) -> None:
    assert "spherical_pendulum" in [m["name"] for m in server.get("/v1/models").json()]
    assert server.get("/v1/models/none").status_code == 404
    assert "properties" in server.get("/v1/schema").json()


def test_health_readiness_and_metrics_are_reported(server: InProcess, small: str) -> None:
    assert server.get("/healthz").json()["status"] == "ok"
    assert server.get("/readyz").status_code == 200
    text = server.get("/metrics").text
    assert 'trunnion_jobs{state="done"}' in text
    assert "trunnion_cases_total" in text
