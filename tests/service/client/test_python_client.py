"""Jobs as Python objects. The server's results equal the results of ``trunnion.sweep``, and have units and the dimensions of a
grid."""

from __future__ import annotations

import io
import json
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

import trunnion
from tests.service.http_servers import MU, PATIENCE, Served, as_stored
from trunnion.basics.errors import SceneError, SimulationError
from trunnion.service.client.remote_jobs import Connection, Job, connect

FORCE, START = "max:ball.contact[1].normal_force", "gravity[3]"
OVER = {MU: "0.1:0.6:6", START: [-9.9, -9.8, -9.7]}


@pytest.fixture(scope="module")
def there(served: Served) -> Connection:
    """A server as users run it."""
    return connect(str(served.client.base_url))


@pytest.fixture(scope="module")
def job(there: Connection) -> Job:
    """A job of a grid, after its end."""
    made = there.submit("spherical_pendulum", OVER, reductions=[FORCE, "first:reversal"], until=0.5, every="10 ms", tags=["grid"])
    assert made.state == "queued"
    assert made.wait(progress=True, timeout=PATIENCE).state == "done"
    return made


@pytest.fixture(scope="module")
def whole() -> Any:
    """The result of ``trunnion.sweep`` for the same grid."""
    return trunnion.sweep("spherical_pendulum", OVER, reductions=[FORCE, "first:reversal"], until=0.5, every=0.01)


def test_a_job_gives_the_table_of_a_sweep(job: Job, whole: Any) -> None:
    assert job.to_arrow().to_pylist() == as_stored(whole.table).to_pylist()
    frame, expected = job.to_pandas(), whole.to_pandas()
    assert frame.drop(columns="version").equals(expected)
    assert frame.attrs["units"] == expected.attrs["units"] | {"version": ""}
    assert list(job.to_pandas(["case", FORCE]).columns) == [FORCE]


def test_a_grid_has_a_dimension_for_each_path(job: Job, whole: Any) -> None:
    pytest.importorskip("xarray")
    data = job.to_xarray()
    assert dict(data.sizes) == {MU: 6, START: 3}
    assert data[FORCE].attrs["units"] == "N"
    for row in whole.table.to_pylist():
        at = data.sel({MU: row[MU], START: row[START]})
        assert float(at[FORCE]) == row[FORCE]
        assert at["outcome"].item() == row["outcome"]
        assert np.isnan(float(at["first:reversal"])) == (row["first:reversal"] is None)


def test_a_list_of_cases_has_the_dimension_of_its_cases(there: Connection) -> None:
    pytest.importorskip("xarray")
    made = there.submit("spherical_pendulum", cases=[{MU: 0.2}, {MU: 0.4}], reductions=FORCE, until=0.1).wait()
    data = made.to_xarray()
    assert (dict(data.sizes), data[MU].values.tolist()) == ({"case": 2}, [0.2, 0.4])


def test_rows_of_cases_are_had_alone_and_together(job: Job) -> None:
    one = job.trajectory(4, "ball.qd[2]")
    sure = job.trajectory(4, "ball.qd[2]", certify=True)
    assert sure.column_names == ["time", "ball.qd[2]", "time.error", "ball.qd[2].error"]
    assert sure["ball.qd[2]"] == one["ball.qd[2]"]
    assert 0.0 < sure["ball.qd[2].error"][-1].as_py() < 1e-3
    changes = {MU: 0.2, START: -9.8}
    run = trunnion.simulate("spherical_pendulum", 0.5, 0.01, overrides=changes, outputs="ball.qd[2]", kernel="parts")
    assert one["ball.qd[2]"].to_pylist() == pytest.approx(run["ball.qd[2]"].tolist(), rel=1e-12)
    many = job.trajectories("ball.qd[2]", every=0.1, cases=[4, 5])
    assert many.column_names == ["case", "time", "ball.qd[2]"]
    assert many["case"].to_pylist() == [4] * 6 + [5] * 6
    assert many["time"].to_numpy()[:6] == pytest.approx(np.linspace(0.0, 0.5, 6), abs=1e-12)
    with pytest.raises(SimulationError, match="is not a multiple of the spacing"):
        job.trajectories("ball.qd[2]", every=0.0333, cases=[4])
    with pytest.raises(SceneError, match="not a spacing"):
        job.trajectories(every=-1.0, cases=[4])


def test_parquet_holds_units_and_the_request(job: Job, served: Served) -> None:
    schema = pq.read_schema(io.BytesIO(served.get(f"/v1/jobs/{job.id}/results?format=parquet").content))
    assert schema.field(FORCE).metadata[b"unit"] == b"N"
    assert schema.metadata[b"job"].decode() == job.id
    asked = json.loads(schema.metadata[b"request"])
    assert asked == job.request
    assert asked["vary"] == OVER


def test_jobs_are_found_again_submitted_again_cancelled_and_deleted(there: Connection, job: Job) -> None:
    assert [j.id for j in there.jobs(tag="grid")] == [job.id]
    assert "18 of 18 cases of spherical_pendulum" in repr(there.job(job.id))
    long = {"vary": {MU: "0.1:0.6:5000"}, "until": 1000.0, "every": 0.01, "idempotency_key": "again"}
    again = there.submit("spherical_pendulum", **long)
    assert there.submit("spherical_pendulum", **long).id == again.id
    with pytest.raises(TimeoutError, match="continues"):
        again.wait(timeout=0.0)
    with pytest.raises(SimulationError, match="has not ended"):
        again.delete()
    again.cancel()
    assert again.wait(timeout=PATIENCE).state == "cancelled"
    again.delete()
    with pytest.raises(SimulationError, match="no such job"):
        again.refresh()


def test_an_invalid_request_raises_an_error_with_all_problems(there: Connection) -> None:
    with pytest.raises(SceneError) as e:
        there.submit("spherical_pendulum", {"joints.ball.friction.nu": [1]}, until=-1)
    assert {p.where for p in e.value.problems} >= {"until", "vary.joints.ball.friction.nu"}
    with pytest.raises(SceneError, match="not an address"):
        connect("nonsense")
