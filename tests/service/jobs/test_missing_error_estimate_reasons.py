"""The reason for a missing error of a case is the same over REST, in the client, on the page and in a local sweep."""

from __future__ import annotations

import csv
import io
from typing import Any

import pyarrow.parquet as pq
import pytest

import trunnion
from tests.service.http_servers import PATIENCE, Served
from tests.service.page.chromium_tab import browser, page, show, tab
from trunnion.batch.tables.case_table import WHY
from trunnion.service.client.remote_jobs import Job, connect

__all__ = ["browser", "page", "tab"]
GUIDE, LAST = "joints.guide.friction.mu", "final:guide.q[1]"
ASKED: dict[str, Any] = {"vary": {GUIDE: [0.1, 0.45, 0.6], "simulation.rtol": [1e-3, 1e-8]}, "reductions": [LAST], "until": 2.0}


@pytest.fixture(scope="module")
def job(served: Served) -> Job:
    """A job in which some cases have no errors."""
    return connect(str(served.client.base_url)).submit("double_pendulum", certify=True, **ASKED).wait(timeout=PATIENCE)


def test_a_job_gives_the_reason_of_a_missing_error_in_every_form(served: Served, job: Job) -> None:
    said = trunnion.sweep("double_pendulum", certify=True, **ASKED).table[WHY].to_pylist()
    assert len({"", "start"} | set(said)) == len(set(said)) > 2
    assert job.to_arrow()[WHY].to_pylist() == said
    path = f"/v1/jobs/{job.id}/results"
    got = served.get(path, params={"column": ["case", WHY]}).json()
    assert [row[1] for row in got["rows"]] == said
    text = served.get(path, params={"format": "csv"}).text
    assert [row[WHY] for row in csv.DictReader(io.StringIO(text))] == said
    assert pq.read_table(io.BytesIO(served.get(path, params={"format": "parquet"}).content))[WHY].to_pylist() == said
    assert job.bins(GUIDE, within={WHY: ("start",)})["cases"] == said.count("start")


@pytest.mark.slow
def test_the_page_gives_the_reason_beside_the_case(page: Any, job: Job) -> None:
    at = job.to_arrow()[WHY].to_pylist().index("start")
    show(page, f"/jobs/{job.id}?cases={at}")
    page.wait_for_selector("#casevalues li:has-text('no errors are stated (start)')")
