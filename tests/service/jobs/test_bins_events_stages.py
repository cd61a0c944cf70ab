"""Partial views of a job: bins, events, scene, start, stages. A client does not have to fetch the whole job."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import trunnion
from tests.service.http_servers import MU, InProcess, Served, eventually
from trunnion.scene import load_scene, scene_from_text, scene_to_dict
from trunnion.service.client.remote_jobs import Job, connect
from trunnion.service.executor.job_stage import read_stage, report_stages
from trunnion.service.executor.parquet_parts import Parts

GUIDE = "joints.guide.friction.mu"
HALF = "joints.guide.friction.half_length"
FORCE = "max:guide.contact[1].normal_force"
ASKED: dict[str, Any] = {
    "scene": "double_pendulum",
    "sample": {"ranges": {GUIDE: [0.05, 0.9], HALF: [0.1, 0.4]}, "count": 90, "seed": 3},
    "reductions": [FORCE, "count:any"],
    "until": 0.1,
}


@pytest.fixture(scope="module")
def job(served: Served) -> Job:
    """A job in which some cases jam."""
    return connect(str(served.client.base_url)).job(served.ended(served.submit(ASKED))["id"])


def test_bins_of_a_job_are_those_of_its_whole_table(job: Job) -> None:
    table = job.to_arrow().to_pydict()
    assert len(set(table["outcome"])) > 1
    got = job.bins(GUIDE, HALF, FORCE, nx=6, ny=5)
    edges = [got[axis]["edges"] for axis in "xy"]
    expected, _, _ = np.histogram2d(table[GUIDE], table[HALF], edges)
    cells = got["cells"]
    counted = np.zeros_like(expected)
    counted[cells["x"], cells["y"]] = cells["cases"]
    assert (counted == expected).all()
    assert (got["complete"], got["cases"], got["left_out"], got["missing"]) == (True, 90, 0, {})
    known = [v for v in table[FORCE] if v is not None]
    assert (sum(cells["known"]), max(m for m in cells["most"] if m is not None)) == (len(known), max(known))
    assert {n: sum(c) for n, c in cells["outcomes"].items()} == job.document["outcomes"]
    assert (got["x"]["unit"], got["y"]["unit"]) == ("1", "m")


def test_bins_keep_to_conditions_and_count_cases_without_a_number(job: Job) -> None:
    table = job.to_arrow().to_pydict()
    got = job.bins(FORCE, within={GUIDE: (0.1, 0.3), "outcome": ("done",)}, nx=4)
    inside = [0.1 <= m <= 0.3 and o == "done" for m, o in zip(table[GUIDE], table["outcome"], strict=True)]
    assert (got["cases"] + sum(got["missing"].values()), got["left_out"]) == (sum(inside), 90 - sum(inside))
    without = job.bins(FORCE)
    assert sum(without["missing"].values()) == sum(v is None for v in table[FORCE])
    assert without["y"] is None


@pytest.mark.parametrize(
    ("asked", "where"),
    [
        ("x=", "x"),
        ("x=nix", "x"),
        ("x=outcome", "x"),
        (f"x={GUIDE}&of=audit", "of"),
        (f"x={GUIDE}&within=nix=0:1", "within"),
        (f"x={GUIDE}&within={GUIDE}=a:1", "within"),
        (f"x={GUIDE}&within={GUIDE}=nan:", "within"),
        (f"x={GUIDE}&within={GUIDE}", "within"),
    ],
)
def test_bins_that_mean_nothing_are_problems(job: Job, served: Served, asked: str, where: str) -> None:
    answer = served.get(f"/v1/jobs/{job.id}/bins?{asked}")
    assert (answer.status_code, [p["where"] for p in answer.json()["problems"]]) == (422, [where])


def test_bins_of_a_finished_job_are_not_sent_twice(job: Job, served: Served) -> None:
    there = f"/v1/jobs/{job.id}/bins?x={GUIDE}"
    first = served.get(there)
    assert served.get(there, headers={"If-None-Match": first.headers["etag"]}).status_code == 304
    other = served.get(f"{there}&nx=3", headers={"If-None-Match": first.headers["etag"]})
    assert (other.status_code, len(other.json()["x"]["edges"])) == (200, 4)


def test_events_of_a_case_are_those_of_the_run(job: Job) -> None:
    done = job.to_arrow().to_pydict()["outcome"].index("done")
    told = job.events(done)
    changes = {p: job.to_arrow().to_pydict()[p][done] for p in (GUIDE, HALF)}
    own = trunnion.simulate("double_pendulum", overrides=changes, until=0.1)
    assert [(e["time"], e["kind"], e["joint"]) for e in told["events"]] == [(e.time, e.kind, e.joint) for e in own.events]
    assert (told["count"], told["outcome"]["name"]) == (len(own.events), "done")


def test_the_scene_of_a_job_comes_back_as_text_that_means_the_same(job: Job, served: Served) -> None:
    answer = served.get(f"/v1/jobs/{job.id}/scene")
    assert answer.headers["content-type"].startswith("application/yaml")
    again = scene_to_dict(scene_from_text(answer.text))
    assert again == scene_to_dict(load_scene("double_pendulum"))
    assert again == job.request["scene"]


def test_a_scene_is_drawn_at_its_start_or_its_problems_are_reported(server: InProcess) -> None:
    page = server.post("/v1/scenes/view?shown=names=1%26bare=1", {"scene": "crank_slider"})
    assert (page.status_code, page.headers["content-type"].split(";")[0]) == (200, "text/html")
    assert "crank" in page.text
    assert "bare=1" in page.text
    wrong = server.post("/v1/scenes/view", {"scene_text": "schema: 1\nbodies: {a: {box: [1, 1, -1], density: 1}}\n"})
    assert (wrong.status_code, 2 in [p["line"] for p in wrong.json()["problems"]]) == (422, True)
    cannot = server.post("/v1/scenes/view", {"scene": "crank_slider", "overrides": {"bodies.rod.points.end[3]": 5}})
    assert (cannot.status_code, "cannot be drawn" in cannot.json()["problems"][0]["what"]) == (422, True)
    assert server.post("/v1/scenes/view?shown=<script>", {"scene": "crank_slider"}).status_code == 422


def test_stages_are_kept_only_of_the_first_piece_and_only_real_ones(tmp_path: Path) -> None:
    parts = Parts(str(tmp_path))
    with report_stages(parts, "a", wanted=True) as tell:
        tell("deriving")
        assert read_stage(parts, "a") == "deriving"
    with report_stages(parts, "b", wanted=False) as tell:
        tell("deriving")
    assert read_stage(parts, "b") == ""
    parts.write(parts.stage_file("a"), b"<nonsense>")
    assert read_stage(parts, "a") == ""
    (tmp_path / "c").write_text("a file where a folder is expected")
    with report_stages(parts, "c", wanted=True) as tell:
        tell("deriving")  # if the report of a stage cannot be written, the work continues


def test_compilation_of_a_kernel_is_reported_while_it_lasts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from trunnion.kernel.compilation import c_compiler

    monkeypatch.setattr(c_compiler, "_zig", lambda *_: (0, ""))
    parts = Parts(str(tmp_path))
    with report_stages(parts, "a", wanted=True) as tell:
        tell("deriving")
        c_compiler.run(["-o", "nothing"], tmp_path)
        assert read_stage(parts, "a") == "compiling"
    c_compiler.run(["-o", "nothing"], tmp_path)  # no job receives a report


def test_a_jobs_document_says_its_stage(served: Served) -> None:
    there = served.submit({"scene": "spherical_pendulum", "vary": {MU: "0.1:0.6:3"}, "until": 0.1})
    seen = set()
    eventually(lambda: seen.add((d := served.job(there))["stage"]) or d["state"] == "done")
    assert seen <= {"waiting", "starting", "deriving", "compiling", "running", "done"}
    assert served.job(there)["stage"] == "done"
