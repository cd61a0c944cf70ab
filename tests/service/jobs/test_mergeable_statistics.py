"""Questions to very many cases are answered from tallies beside the parts: as from all rows where that is exact, else from rows
that were drawn, and the answer says so. What is missing or spoilt of them follows from the parts."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest

from tests.batch.test_mergeable_statistics import same
from tests.service.executor.test_part_checksums import SPOILT
from tests.service.http_servers import InProcess
from tests.service.jobs.test_bins_events_stages import FORCE, GUIDE, HALF
from trunnion.batch.sample_statistics import mergeable_statistics
from trunnion.batch.sample_statistics.mergeable_statistics import Tally, tally_of, unpacked
from trunnion.service.api.job_data import job_rows
from trunnion.service.api.job_data import tally_totals as answers
from trunnion.service.api.job_data.job_rows import job_contents
from trunnion.service.basics.recent_items import RecentItems
from trunnion.service.executor import part_tallies
from trunnion.service.executor.chunk_and_case_runs import run_chunk
from trunnion.service.executor.parquet_parts import Parts
from trunnion.service.executor.part_checksum import Piece, digest_of, document_bytes, read_part_bytes

ASKED: dict[str, Any] = {
    "scene": "double_pendulum",
    "sample": {"ranges": {GUIDE: [0.05, 0.6], HALF: [0.1, 0.4]}, "count": 40, "seed": 3, "method": "saltelli"},
    "reductions": [FORCE, "count:any"],
    "until": 0.1,
}
CASES = 240
QUESTIONS = ("indices", f"spreads?at=0.1&at=0.9&above={FORCE}%3D900", f"bins?x={GUIDE}&y={HALF}&of={FORCE}&nx=6&ny=5",
             f"bins?x={FORCE}&within={GUIDE}%3D0.1:0.3")  # fmt: skip


@pytest.fixture(scope="module")
def job(server: InProcess) -> str:
    """A crossed sample in which some cases jam, in several pieces, none of them with a tally."""
    made = server.submit(ASKED)
    end = server.ended(made)
    assert (end["state"], end["done"], len(end["outcomes"])) == ("done", CASES, 2)
    assert len(server.service.store.finished(made)) > 3
    return made


@pytest.fixture
def many(server: InProcess, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A server without knowledge of its jobs, for which this small number of cases counts as very many."""
    monkeypatch.setattr(part_tallies, "MANY", 10)
    monkeypatch.setattr(server.service, "tallies", RecentItems(1))
    yield
    for file in (server.service.settings.data / "results").glob("*/tally*"):
        file.unlink()


def asked(server: InProcess, job: str) -> list[Any]:
    found = [server.get(f"/v1/jobs/{job}/{question}") for question in QUESTIONS]
    assert [f.status_code for f in found] == [200] * len(QUESTIONS)
    return [f.json() for f in found]


def files(server: InProcess, job: str, what: str) -> list[Path]:
    return sorted((server.service.settings.data / "results" / job).glob(f"{what}-*"))


def counted(server: InProcess, job: str) -> Tally:
    found = answers.job_tally(server.service, job)
    assert found is not None
    return found


def of_rows(server: InProcess, job: str) -> Tally:
    there = job_contents(server.service, job)
    rows = pa.concat_tables(job_rows.result_rows(server.service, job, there.plan.schema, 0, CASES))
    return tally_of(rows, there.plan.cases, there.plan.reductions)


@pytest.fixture(scope="module")
def exact(server: InProcess, job: str) -> list[Any]:
    """The answers from all rows."""
    return asked(server, job)


def alike(a: Any, b: Any) -> None:
    """Check that both answers are the same, numbers up to the rounding of sums over all rows."""
    if isinstance(a, dict):
        assert a.keys() == b.keys()
        for k in a:
            alike(a[k], b[k])
    elif isinstance(a, list):
        assert len(a) == len(b)
        for x, y in zip(a, b, strict=True):
            alike(x, y)
    elif isinstance(a, float) and isinstance(b, float):
        assert a == pytest.approx(b, rel=1e-9, abs=1e-11)
    else:
        assert a == b


@pytest.mark.usefixtures("many")
def test_answers_from_tallies_are_those_from_all_rows_where_all_are_drawn(server: InProcess, job: str, exact: list[Any]) -> None:
    got = asked(server, job)
    assert [e.pop("drawn", None) for e in exact] == [None] * 4, "of few cases all rows are read"
    assert [g.pop("drawn", None) for g in got] == [None, *[{"cases": CASES, "of": CASES}] * 3]
    assert exact[2].pop("whole") is exact[3].pop("whole") is None
    whole = got[2].pop("whole")
    assert got[3].pop("whole")[FORCE] == whole[FORCE]
    alike(got, exact)
    cells = exact[2]["cells"]
    assert whole[FORCE]["known"] == sum(cells["known"])
    assert whole[FORCE]["most"] == max(v for v in cells["most"] if v is not None)
    assert whole[FORCE]["least"] == min(v for v in cells["least"] if v is not None)
    assert same(counted(server, job), of_rows(server, job))


@pytest.mark.usefixtures("many")
def test_where_some_cases_are_drawn_it_is_said_and_sums_and_ends_are_of_all(
    server: InProcess, job: str, exact: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mergeable_statistics, "DRAWN", 60)
    got = asked(server, job)
    n = got[2]["drawn"]["cases"]
    assert 20 < n < 120
    assert {x["note"].rpartition("; ")[2] for x in got[1]["spreads"]} == {f"{n} of {CASES} cases, selected at random"}
    assert got[1]["drawn"] == got[3]["drawn"] == {"cases": n, "of": CASES}
    assert sum(got[2]["cells"]["cases"]) == got[2]["cases"] == n
    assert got[3]["cases"] + got[3]["left_out"] + sum(got[3]["missing"].values()) == n
    alike(got[0]["indices"], exact[0]["indices"])
    for axis in "xy":  # from the least of all to the largest of all
        np.testing.assert_allclose([got[2][axis]["edges"][i] for i in (0, -1)], [exact[2][axis]["edges"][i] for i in (0, -1)])


@pytest.mark.default_cases(1)
@pytest.mark.usefixtures("many")
@pytest.mark.parametrize("how", SPOILT)
def test_a_spoilt_tally_follows_from_its_part_and_a_spoilt_part_beside_its_tally_is_not_missed(
    server: InProcess, job: str, how: str
) -> None:
    before = counted(server, job)
    assert len(files(server, job, "tally")) == len(files(server, job, "part"))
    place = files(server, job, "tally")[1]
    written = place.read_bytes()
    if how != "exchanged":
        SPOILT[how](place)
    else:
        place.write_bytes(files(server, job, "tally")[2].read_bytes())
    server.service.tallies = RecentItems(1)
    assert same(counted(server, job), before)
    assert place.read_bytes() == written, "it is kept for the next time"
    part = files(server, job, "part")[1]
    kept = part.read_bytes()
    SPOILT[how](part)
    server.service.tallies = RecentItems(1)
    assert same(counted(server, job), before)
    place.unlink()
    server.service.tallies = RecentItems(1)
    assert same(counted(server, job), before), "both were computed again"
    assert part.read_bytes() == kept


@pytest.mark.usefixtures("many")
def test_what_a_whole_job_comes_to_is_kept_and_read_in_one(server: InProcess, job: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(answers, "BATCH", 2)
    before = counted(server, job)
    for file in files(server, job, "tally"):
        file.write_bytes(b"not to be read")
    server.service.tallies = RecentItems(1)
    assert same(counted(server, job), before)
    Path(server.service.parts.all_tally(job)).write_bytes(b"spoilt")
    server.service.tallies = RecentItems(1)
    assert same(counted(server, job), before)


@pytest.mark.usefixtures("many")
def test_while_a_job_goes_on_only_what_is_new_is_read(server: InProcess, job: str, monkeypatch: pytest.MonkeyPatch) -> None:
    store, every = server.service.store, server.service.store.finished(job)
    asked_for: list[int] = []
    whole = part_tallies.tallies

    def seen(parts: Parts, pieces: list[Piece], plan: Any) -> Any:
        asked_for.extend(p.start for p in pieces)
        return whole(parts, pieces, plan)

    monkeypatch.setattr(answers, "tallies", seen)
    for there in ([], every[:2], every[:2], every[1:3], every[1:]):
        monkeypatch.setattr(store, "finished", lambda job, there=there: there)
        assert counted(server, job).cases == sum(c.stop - c.start for c in there)
    starts = [c.start for c in every]
    assert asked_for == [*starts[:2], *starts[1:3], *starts[3:]], "a piece that is gone makes all be counted again"


@pytest.fixture
def alone(tmp_path: Path, server: InProcess, job: str, monkeypatch: pytest.MonkeyPatch) -> tuple[Parts, Piece]:
    """A piece that this process computes as a worker does."""
    monkeypatch.setattr(part_tallies, "MANY", 10)
    parts, document = Parts(str(tmp_path)), document_bytes(server.service.store.document(job))
    parts.write(parts.job_file("job"), document)
    return parts, Piece("job", digest_of(document), 15, 33)


def test_a_worker_keeps_a_tally_before_its_part_and_counts_its_bytes(alone: tuple[Parts, Piece]) -> None:
    parts, piece = alone
    said = run_chunk(parts.url, piece, 600.0)
    there = [Path(f) for f in (parts.tally(piece), parts.part(piece))]
    assert said["bytes"] == sum(f.stat().st_size for f in there)
    assert parts.part_outcomes(piece) == (said["counts"], said["bytes"], said["version"])
    assert there[0].stat().st_mtime_ns <= there[1].stat().st_mtime_ns
    got = unpacked(read_part_bytes(there[0].read_bytes(), piece.of_tally))
    assert (got.cases, sorted(got.drawn["case"].to_pylist())) == (18, list(range(15, 33)))
    assert run_chunk(parts.url, piece, 600.0)["bytes"] == said["bytes"], "what is there is taken as it is"


def test_a_worker_killed_between_tally_and_part_leaves_nothing_that_is_taken_for_done(
    alone: tuple[Parts, Piece], monkeypatch: pytest.MonkeyPatch
) -> None:
    parts, piece = alone

    def killed(*given: Any) -> int:
        raise KeyboardInterrupt

    with monkeypatch.context() as m:
        m.setattr(Parts, "write_part", killed)
        with pytest.raises(KeyboardInterrupt):
            run_chunk(parts.url, piece, 600.0)
    tally_file = Path(parts.tally(piece))
    first = tally_file.read_bytes()
    assert parts.part_outcomes(piece) is None
    assert run_chunk(parts.url, piece, 600.0)["counts"]
    assert tally_file.read_bytes() == first
