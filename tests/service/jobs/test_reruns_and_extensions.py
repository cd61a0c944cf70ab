"""Jobs that follow from other jobs: failed cases that run again, and additional cases."""

from __future__ import annotations

import pytest

import trunnion
from tests.service.http_servers import MU, Served, as_stored

END = "simulation.until"
MIXED = [{MU: 0.0, END: 20_000.0}, {MU: 0.2, END: 0.2}, {MU: 0.0, END: 10_000.0}, {MU: 0.3, END: 0.2}]
ASKED = {"scene": "spherical_pendulum", "reductions": ["final:ball.q[1]"], "every": 0.01, "kernel": "parts"}


@pytest.fixture(scope="module")
def failed(served: Served) -> str:
    """A job in which two cases have run out of steps."""
    job = served.submit(ASKED | {"cases": MIXED, "max_steps": 300, "label": "mixed", "tags": ["a"]})
    assert served.ended(job)["outcomes"] == {"max_steps": 2, "done": 2}
    return job


@pytest.mark.slow
def test_cases_that_failed_are_run_again_with_other_settings(served: Served, failed: str) -> None:
    again = served.post(f"/v1/jobs/{failed}/rerun", {"max_steps": 400})
    assert (again.status_code, again.headers["location"]) == (202, f"/v1/jobs/{again.json()['id']}")
    end = served.ended(again.json()["id"])
    assert (end["cases"], end["label"], end["tags"]) == (2, "mixed", [f"of:{failed}"])
    alone = trunnion.sweep("spherical_pendulum", cases=MIXED[::2], reductions=ASKED["reductions"], every=0.01, max_steps=400)
    assert served.rows(end["id"]) == [list(r.values()) for r in as_stored(alone.table).to_pylist()]
    assert [r[-2] for r in served.rows(end["id"])] == [400, 400]


def test_only_cases_with_the_outcomes_named_are_run_again(served: Served, failed: str) -> None:
    done = served.post(f"/v1/jobs/{failed}/rerun", {"outcomes": ["done"], "tags": ["b"]}).json()
    assert (served.ended(done["id"])["outcomes"], done["tags"]) == ({"done": 2}, ["b", f"of:{failed}"])
    for body, status in (({"outcomes": ["jammed"]}, 409), ({"outcome": []}, 422), ({"max_steps": -1}, 422)):
        assert served.post(f"/v1/jobs/{failed}/rerun", body).status_code == status
    assert served.post(f"/v1/jobs/{done['id']}/rerun", {}).status_code == 409
    assert served.post(f"/v1/jobs/{'0' * 24}/rerun", {}).status_code == 404


def test_a_sweep_is_extended_by_the_cases_that_it_has_not(served: Served) -> None:
    first = served.submit(ASKED | {"vary": {MU: [0.1, 0.2, 0.3], "gravity[3]": [-9.8, -9.7]}, "until": 0.2})
    more = served.post(f"/v1/jobs/{first}/extend", {"vary": {"gravity[3]": [-9.7, -9.6], MU: [0.2, 0.3, 0.4]}}).json()
    end = served.ended(more["id"])
    assert (end["cases"], end["tags"]) == (4, [f"of:{first}"])
    rows = {tuple(r[1:3]) for r in served.rows(more["id"])}
    assert rows == {(-9.7, 0.4), (-9.6, 0.2), (-9.6, 0.3), (-9.6, 0.4)}
    kept = served.get(f"/v1/jobs/{more['id']}/request").json()
    assert (kept["until"], kept["reductions"], kept["every"]) == (0.2, ASKED["reductions"], 0.01)
    same = served.post(f"/v1/jobs/{first}/extend", {"vary": {MU: [0.1], "gravity[3]": [-9.8]}})
    assert (same.status_code, "already has all these" in same.text) == (422, True)
    for wrong in ({}, {"vary": {MU: [1]}, "cases": [{MU: 1}]}, {"vary": {"nowhere": [1]}}, {"vary": {MU: [1]}, "label": "\0"}):
        assert served.post(f"/v1/jobs/{first}/extend", wrong).status_code == 422
