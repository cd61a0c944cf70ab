"""Jobs that follow from others: failed cases again, additional cases."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

import trunnion
from tests.service.http_servers import MU, InProcess, as_stored
from trunnion.service.basics.server_settings import Settings

END = "simulation.until"
MIXED = [{MU: 0.0, END: 20_000.0}, {MU: 0.2, END: 0.2}, {MU: 0.0, END: 10_000.0}, {MU: 0.3, END: 0.2}]
ASKED = {"scene": "spherical_pendulum", "reductions": ["final:ball.q[1]"], "every": 0.01, "kernel": "parts"}


@pytest.fixture(scope="module")
def following(tmp_path_factory: pytest.TempPathFactory) -> Iterator[InProcess]:
    """A server of one worker."""
    with InProcess(Settings(tmp_path_factory.mktemp("following"), workers=1)) as s:
        yield s


@pytest.fixture(scope="module")
def failed(following: InProcess) -> str:
    """A job in which two cases have run out of steps."""
    job = following.submit(ASKED | {"cases": MIXED, "max_steps": 300, "label": "mixed", "tags": ["a"]})
    assert following.ended(job)["outcomes"] == {"max_steps": 2, "done": 2}
    return job


@pytest.mark.slow
def test_cases_that_failed_are_run_again_with_other_settings(following: InProcess, failed: str) -> None:
    again = following.post(f"/v1/jobs/{failed}/rerun", {"max_steps": 400})
    assert (again.status_code, again.headers["location"]) == (202, f"/v1/jobs/{again.json()['id']}")
    end = following.ended(again.json()["id"])
    assert (end["cases"], end["label"], end["tags"]) == (2, "mixed", [f"of:{failed}"])
    alone = trunnion.sweep("spherical_pendulum", cases=MIXED[::2], reductions=ASKED["reductions"], every=0.01, max_steps=400)
    assert following.rows(end["id"]) == [list(r.values()) for r in as_stored(alone.table).to_pylist()]
    assert [r[-2] for r in following.rows(end["id"])] == [400, 400]


def test_only_cases_with_the_outcomes_named_are_run_again(following: InProcess, failed: str) -> None:
    done = following.post(f"/v1/jobs/{failed}/rerun", {"outcomes": ["done"], "tags": ["b"]}).json()
    assert (following.ended(done["id"])["outcomes"], done["tags"]) == ({"done": 2}, ["b", f"of:{failed}"])
    for body, status in (({"outcomes": ["jammed"]}, 409), ({"outcome": []}, 422), ({"max_steps": -1}, 422)):
        assert following.post(f"/v1/jobs/{failed}/rerun", body).status_code == status
    assert following.post(f"/v1/jobs/{done['id']}/rerun", {}).status_code == 409
    assert following.post(f"/v1/jobs/{'0' * 24}/rerun", {}).status_code == 404


def test_a_sweep_is_extended_by_the_cases_that_it_has_not(following: InProcess) -> None:
    first = following.submit(ASKED | {"vary": {MU: [0.1, 0.2, 0.3], "gravity[3]": [-9.8, -9.7]}, "until": 0.2})
    more = following.post(f"/v1/jobs/{first}/extend", {"vary": {"gravity[3]": [-9.7, -9.6], MU: [0.2, 0.3, 0.4]}}).json()
    end = following.ended(more["id"])
    assert (end["cases"], end["tags"]) == (4, [f"of:{first}"])
    rows = {tuple(r[1:3]) for r in following.rows(more["id"])}
    assert rows == {(-9.7, 0.4), (-9.6, 0.2), (-9.6, 0.3), (-9.6, 0.4)}
    kept = following.get(f"/v1/jobs/{more['id']}/request").json()
    assert (kept["until"], kept["reductions"], kept["every"]) == (0.2, ASKED["reductions"], 0.01)
    same = following.post(f"/v1/jobs/{first}/extend", {"vary": {MU: [0.1], "gravity[3]": [-9.8]}})
    assert (same.status_code, "already has all these" in same.text) == (422, True)
    for wrong in ({}, {"vary": {MU: [1]}, "cases": [{MU: 1}]}, {"vary": {"nowhere": [1]}}, {"vary": {MU: [1]}, "label": "\0"}):
        assert following.post(f"/v1/jobs/{first}/extend", wrong).status_code == 422
