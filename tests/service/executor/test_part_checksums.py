"""Every part contains its identity and a checksum of its bytes. A reader finds any damage, and the damaged part is computed
again."""

from __future__ import annotations

import random
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from tests.service.http_servers import MU, SMALL, InProcess, eventually
from tests.service.store.single_chunks import cut
from trunnion.basics.version import version
from trunnion.batch.plan_and_runner import Runner
from trunnion.service.basics.server_settings import Limits, Settings
from trunnion.service.executor import chunk_and_case_runs as runs
from trunnion.service.executor.job_leases import LeasedJobs
from trunnion.service.executor.parquet_parts import Parts
from trunnion.service.executor.part_file_format import CaseRange, CorruptPart, digest_of
from trunnion.service.request_models.job_request import JobRequest, plan_of_request
from trunnion.service.store.leases_and_chunks import WorkStore

ASKED = plan_of_request(JobRequest.model_validate(SMALL), Limits())


@pytest.fixture(scope="module")
def pieces(tmp_path_factory: pytest.TempPathFactory) -> tuple[Parts, list[CaseRange], list[Any]]:
    """Parts of two neighbouring pieces of a job, and of the same cases of another job, with their tables."""
    parts = Parts(str(tmp_path_factory.mktemp("parts")))
    runner = Runner(ASKED)
    found = [CaseRange("a", "d", 0, 10), CaseRange("a", "d", 10, 20), CaseRange("b", "e", 0, 10)]
    tables = [runner.chunk(p.start, p.stop) for p in found]
    for case_range, table in zip(found, tables, strict=True):
        parts.write_part(case_range, table)
    return parts, found, tables


def test_a_part_is_an_ordinary_parquet_file_with_what_was_computed(pieces: tuple[Parts, list[CaseRange], list[Any]]) -> None:
    parts, found, tables = pieces
    for case_range, table in zip(found, tables, strict=True):
        assert parts.read_part(case_range)[0].equals(table)
        assert pq.read_table(parts.part(case_range)).equals(table)
        assert parts.part_outcomes(case_range) == ({"done": 10}, Path(parts.part(case_range)).stat().st_size, version())


def test_each_of_200_random_bit_flips_is_found(pieces: tuple[Parts, list[CaseRange], list[Any]]) -> None:
    parts, (case_range, *_), _ = pieces
    file, chance = Path(parts.part(case_range)), random.Random(4)
    whole = file.read_bytes()
    for _ in range(200):
        spoiled, at = bytearray(whole), chance.randrange(8 * len(whole))
        spoiled[at // 8] ^= 1 << at % 8
        file.write_bytes(spoiled)
        with pytest.raises(CorruptPart):
            parts.read_part(case_range)
        assert parts.part_outcomes(case_range) is None
    file.write_bytes(whole)
    parts.read_part(case_range)


def test_files_of_other_parts_and_cut_or_empty_files_are_no_parts(pieces: tuple[Parts, list[CaseRange], list[Any]]) -> None:
    parts, (case_range, neighbour, stranger), _ = pieces
    file = Path(parts.part(case_range))
    whole = file.read_bytes()
    others = [Path(parts.part(p)).read_bytes() for p in (neighbour, stranger)]
    for wrong in (*others, whole[:-1], whole[: len(whole) // 2], b"", whole + b"\0"):
        file.write_bytes(wrong)
        assert parts.part_outcomes(case_range) is None
    file.unlink()
    with pytest.raises(CorruptPart):
        parts.read_part(case_range)
    file.write_bytes(whole)
    assert parts.part_outcomes(CaseRange("a", "another document", 0, 10)) is None


def flipped(file: Path) -> None:
    """Invert one bit in the middle."""
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 1
    file.write_bytes(data)


def exchanged(file: Path) -> None:
    """Replace a part by another part."""
    other = next(f for f in sorted(file.parent.glob("part-*")) if f != file)
    shutil.copyfile(other, file)


SPOILT: dict[str, Callable[[Path], None]] = {
    "flipped": flipped,
    "exchanged": exchanged,
    "cut off": lambda f: f.write_bytes(f.read_bytes()[:-7]),
    "removed": lambda f: f.unlink(),
}


@pytest.fixture(scope="module")
def job(server: InProcess) -> str:
    """A finished job of several parts."""
    made = server.submit(SMALL | {"vary": {MU: "0.1:0.6:60"}})
    assert server.ended(made)["state"] == "done"
    return made


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("how", SPOILT)
def test_a_spoilt_part_is_computed_again_when_it_is_read_and_that_is_reported(server: InProcess, job: str, how: str) -> None:
    before, document = server.rows(job), server.job(job)
    folder = server.service.settings.data / "results" / job
    files = sorted(folder.glob("part-*"))
    assert len(files) > 1
    SPOILT[how](files[1])
    assert server.rows(job) == before
    after = server.ended(job)
    same = ("state", "finished", "cases", "done", "lost", "outcomes", "bytes", "problems")
    assert {k: after[k] for k in same} == {k: document[k] for k in same}
    told = [e for e in server.service.store.events(job) if e.kind == "part_spoiled"]
    assert told[-1].data["computed_again"] is True
    assert server.rows(job) == before


def test_a_spoilt_document_beside_the_parts_is_written_again(server: InProcess, job: str) -> None:
    place = f"/v1/jobs/{job}/cases/3/trajectory"
    before, client = server.get(place).json(), server.service.cluster.connect()
    for how in ("flipped", "removed"):
        SPOILT[how](server.service.settings.data / "results" / job / "job.json")
        client.gather([client.submit(lambda: runs._local.__dict__.clear(), workers=[w], pure=False) for w in client.nthreads()])
        assert server.get(place).json() == before


@pytest.mark.parametrize("left", [b"PAR1 is all that is left", b"", None])
def test_a_chunk_whose_part_cannot_be_read_is_run_again_by_the_next_server(tmp_path: Path, left: bytes | None) -> None:
    """A chunk without a readable part must not keep its job running for ever."""
    store, parts = WorkStore(f"sqlite:///{tmp_path / 'store.db'}"), Parts(str(tmp_path / "parts"))
    store.upgrade()
    job, _ = store.submit("me", "d", "arm", "", "{}", 20, 60.0)
    store.claim("a server that was killed", 60.0)
    store.begin("a server that was killed", job.id)
    chunk = cut(store, "a server that was killed", job.id, 20)
    store.release("a server that was killed")
    assert chunk is not None
    if left is not None:
        parts.write(parts.part(CaseRange(job.id, digest_of(b"{}"), 0, 20)), left)
    LeasedJobs(store, parts, Settings(tmp_path))._claim()
    assert store.running(job.id) == []
    again = store.job(job.id)
    assert again is not None
    assert (again.state, again.done) == ("running", 0)
    store.close()


def test_damaged_rows_of_a_cancelled_job_are_reported_as_lost(server: InProcess) -> None:
    job = server.submit(SMALL | {"vary": {MU: "0.1:0.6:5000"}, "until": 1000.0, "every": 0.01})
    eventually(lambda: server.job(job)["done"] > 0)
    server.client.delete(f"/v1/jobs/{job}")
    end = server.ended(job)
    flipped(sorted((server.service.settings.data / "results" / job).glob("part-*"))[0])
    rows = server.rows(job)
    after = server.job(job)
    assert (after["state"], len(rows)) == ("cancelled", after["done"])
    assert after["done"] < end["done"]
    assert "are lost" in after["problems"][-1]["what"]
