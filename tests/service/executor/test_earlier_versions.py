"""Rows that an earlier version computed do not change. Each row names the version that computed it."""

from __future__ import annotations

import io
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from sqlalchemy import update

from tests.service.executor.test_part_checksums import flipped
from tests.service.http_servers import MU, SMALL, InProcess
from tests.service.store.single_chunks import chunk_done, cut
from trunnion.basics.renamed_words import current_result, known_result
from trunnion.service.basics.engine_version import engine_version
from trunnion.service.executor.parquet_parts import Parts
from trunnion.service.executor.part_file_format import CaseRange, CorruptPart, digest_of
from trunnion.service.executor.part_versions import shaped, with_version
from trunnion.service.executor.parts_of_earlier_versions import adopt_parts
from trunnion.service.store.database_connection import transaction
from trunnion.service.store.leases_and_chunks import ChunkReport, WorkStore
from trunnion.service.store.table_definitions import EARLIER, UNKNOWN, chunks

FIRST, SECOND = range(4), range(4, 6)


def early_part(cases: range) -> bytes:
    """A part in the format of the first versions: with the names of these versions, and without identity and checksum."""
    outcomes = pa.array(["done", "stopped", "apart", "jammed"][: len(cases)])
    columns = {"case": list(cases), "outcome": outcomes, "steps": [7] * len(cases), "max:j.stop.effort[1]": [1.5] * len(cases)}
    sink = io.BytesIO()
    pq.write_table(pa.table(columns).replace_schema_metadata({"version": "0.0.9"}), sink)
    return sink.getvalue()


@pytest.fixture
def early(tmp_path: Path) -> tuple[WorkStore, Parts, str]:
    """The store and the parts of a finished job of an earlier version; the second of its two parts is damaged."""
    store, parts = WorkStore(f"sqlite:///{tmp_path / 'store.db'}"), Parts(str(tmp_path / "parts"))
    store.upgrade()
    job, _ = store.submit("me", "d", "arm", "", "{}", 6, 60.0)
    store.claim("a server", 60.0)
    store.begin("a server", job.id)
    for cases in (FIRST, SECOND):
        cut(store, "a server", job.id, len(cases))
        chunk_done(store, "a server", job.id, cases.start, ChunkReport({"done": len(cases)}, 0.1, 0.0, 10))
        parts.write(parts.part(CaseRange(job.id, "", cases.start, cases.stop)), early_part(cases)[: None if cases is FIRST else -9])
    assert store.end_if_over("a server", job.id) == "done"
    with transaction(store.engine, writing=True) as c:
        c.execute(update(chunks).values(version=UNKNOWN, counts=""))  # the migration of the database leaves these values
    return store, parts, job.id


def test_finished_rows_of_an_earlier_version_are_read_unchanged_under_todays_names(early: tuple[WorkStore, Parts, str]) -> None:
    store, parts, job = early
    case_range, damaged = (CaseRange(job, digest_of(b"{}"), cases.start, cases.stop) for cases in (FIRST, SECOND))
    with pytest.raises(CorruptPart):
        parts.read_part(case_range)
    adopt_parts(store, parts)
    table = parts.read_part(case_range, ["case", "outcome", "max:j.end_stop.effort[1]"])[0]
    assert table.to_pydict() == {
        "case": list(FIRST),
        "outcome": ["done", "cancelled", "overlap_lost", "jammed"],
        "max:j.end_stop.effort[1]": [1.5] * 4,
    }
    assert parts.part_outcomes(case_range) is not None
    assert parts.part_outcomes(damaged) is None
    assert [c.version for c in store.finished(job)] == [EARLIER] * 2
    before = [f.stat().st_mtime_ns for f in Path(parts.root).rglob("part-*")]
    adopt_parts(store, parts)
    assert [f.stat().st_mtime_ns for f in Path(parts.root).rglob("part-*")] == before
    store.close()


def test_a_column_that_an_earlier_version_did_not_store_is_empty() -> None:
    fields = [pa.field("case", pa.int64()), pa.field("audit", pa.string(), False), pa.field("steps", pa.int64())]
    wanted = with_version(pa.schema(fields))
    table = shaped(pq.read_table(io.BytesIO(early_part(SECOND))), wanted)
    assert table.to_pydict() == {"case": [4, 5], "audit": ["", ""], "version": ["0.0.9"] * 2, "steps": [7, 7]}


def test_old_names_of_results_mean_todays_columns() -> None:
    assert current_result("error:max:j.stop.effort[1]") == "error:max:j.end_stop.effort[1]"
    assert current_result("joints.j.stops.stiffness") == "joints.j.end_stops.stiffness"
    assert current_result("first:stop") == "first:stop"  # results keep the names of their request
    known = ["first:stick", "max:j.end_stop.effort[1]"]
    assert [known_result(n, known) for n in ("first:stop", "max:j.stop.effort[1]", "first:nothing")] == [*known, "first:nothing"]


def test_rows_that_another_version_computes_again_are_reported_and_the_end_of_the_job_stays(server: InProcess) -> None:
    job = server.submit(SMALL | {"vary": {MU: "0.1:0.6:16"}})
    end, store = server.ended(job), server.service.store
    answer = server.get(f"/v1/jobs/{job}/results")
    at = [c["name"] for c in answer.json()["columns"]].index("version")
    rows = answer.json()["rows"]
    assert {r[at] for r in rows} == {engine_version()}
    assert end["problems"] == []
    first, *others = store.finished(job)
    with transaction(store.engine, writing=True) as c:
        c.execute(update(chunks).where(chunks.c.job == job).values(version=EARLIER))
    flipped(sorted((server.service.settings.data / "results" / job).glob("part-*"))[0])
    assert server.rows(job) == rows
    after = server.ended(job)
    assert after["finished"] == end["finished"]
    (told,) = after["problems"]
    assert told["where"] == f"cases 0 to {first.stop - 1}"
    assert engine_version() in told["what"]
    assert EARLIER in told["what"]
    assert [c.version for c in store.finished(job)][-len(others) :] == [EARLIER] * len(others)
    assert server.get(f"/v1/jobs/{job}/results").headers["etag"] != answer.headers["etag"]
