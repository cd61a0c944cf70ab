"""Rows of all cases are stored while a job runs. Like the table, they are checked, counted and fetched. Damaged rows are computed
again."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

import trunnion
from tests.service.http_servers import MU, PATIENCE, SMALL, Served
from trunnion.service.client.remote_jobs import Job, connect

ASKED: dict[str, Any] = {
    "scene": "spherical_pendulum",
    "vary": {MU: "0.1:0.6:30"},
    "reductions": ["final:ball.qd[2]"],
    "trajectories": ["ball.qd[*]"],
    "spacing": 0.05,
    "until": 0.5,
    "every": 0.01,
}


@pytest.fixture(scope="module")
def expected() -> Any:
    """The rows that ``trunnion.sweep`` stores."""
    given = {k: v for k, v in ASKED.items() if k not in ("scene", "vary")}
    return trunnion.sweep("spherical_pendulum", ASKED["vary"], **given)


@pytest.fixture(scope="module")
def job(served: Served) -> Job:
    there = connect(str(served.client.base_url))
    more = {k: v for k, v in ASKED.items() if k not in ("scene", "vary")}
    return there.submit("spherical_pendulum", ASKED["vary"], **more).wait(timeout=PATIENCE)


def test_the_rows_are_fetched_in_every_form_and_none_is_run_again(job: Job, expected: Any, served: Served, tmp_path: Path) -> None:
    assert job.trajectories().to_pylist() == expected.trajectories.to_pylist()
    assert job.trajectories("ball.qd[2]", every=0.1).column_names == ["case", "time", "ball.qd[2]"]
    place = f"/v1/jobs/{job.id}/trajectories"
    answer = served.get(place, params={"format": "parquet"})
    assert pq.read_table(io.BytesIO(answer.content)).to_pylist() == expected.trajectories.to_pylist()
    assert (answer.headers["trunnion-complete"], "etag" in answer.headers) == ("true", True)
    some = served.get(place, params={"first": 7, "count": 2, "column": ["case", "ball.qd[2]"]}).json()
    assert {r[0] for r in some["rows"]} == {7, 8}
    job.save_trajectories(tmp_path / "set")
    assert len(list((tmp_path / "set").iterdir())) == 30


def test_other_columns_are_run_again_as_before(job: Job) -> None:
    rows = job.trajectories("ball.contact[1].normal_force", every=0.1, cases=[3])
    assert (rows.column_names, len(rows)) == (["case", "time", "ball.contact[1].normal_force"], 6)


@pytest.mark.slow
def test_kept_rows_count_as_bytes_and_go_with_their_job(served: Served) -> None:
    plain, kept = (served.submit(ASKED | {"trajectories": t, "spacing": None}) for t in ([], ["ball.*"]))
    sizes = [served.ended(j)["bytes"] for j in (plain, kept)]
    folder = served.data / "results" / kept
    there = sum(f.stat().st_size for f in folder.glob("*.parquet"))
    assert sizes[1] == there > 3 * sizes[0]
    assert served.get("/v1/usage").json()["bytes"] >= sum(sizes)
    assert served.client.delete(f"/v1/jobs/{kept}", params={"purge": "true"}).status_code == 204
    assert not folder.exists()


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("how", ["flipped", "removed", "exchanged"])
def test_rows_that_were_spoilt_are_found_and_computed_again(served: Served, expected: Any, how: str) -> None:
    job = served.submit(ASKED | {"label": how})
    served.ended(job)
    files = sorted(((served.data / "results") / job).glob("rows-*"))
    data = bytearray(files[0].read_bytes())
    data[len(data) // 2] ^= 4
    {"flipped": lambda: files[0].write_bytes(data), "removed": files[0].unlink,
     "exchanged": lambda: files[0].write_bytes(files[-1].read_bytes())}[how]()  # fmt: skip
    rows = served.get(f"/v1/jobs/{job}/trajectories").json()["rows"]
    assert rows == [list(r.values()) for r in expected.trajectories.to_pylist()]
    assert served.ended(job)["done"] == 30


def test_a_job_without_stored_trajectories_has_none_and_invalid_requests_are_refused(served: Served) -> None:
    job = served.submit(SMALL)
    assert served.get(f"/v1/jobs/{job}/trajectories").status_code == 409
    for wrong, where in (({"trajectories": ["nothing"]}, "trajectories"), ({"spacing": 0.1}, "spacing")):
        told = served.post("/v1/jobs/check", SMALL | wrong)
        assert (told.status_code, where in [p["where"] for p in told.json()["problems"]]) == (422, True)
    large = SMALL | {"trajectories": ["*"], "vary": {MU: "0.1:0.6:100000"}, "until": 1000.0, "every": 0.01}
    assert "trajectories" in [p["where"] for p in served.post("/v1/jobs/check", large).json()["problems"]]
    study = {"scene": "spherical_pendulum", "refine": {"bounds": {MU: [0.1, 0.6]}}, "trajectories": ["ball.qd[2]"]}
    assert "trajectories" in [p["where"] for p in served.post("/v1/jobs/check", study).json()["problems"]]
