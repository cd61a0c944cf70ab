"""Finds jobs by their ids, and reads their plans and rows. The checksum of every part is verified when the part is read."""

from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Callable, Iterator
from typing import Any

from trunnion.analysis.fits.fits_as_batch_cases import FitPlan
from trunnion.analysis.studies.study_rounds import ReportedCases
from trunnion.service.api.documents.problem_documents import Refusal
from trunnion.service.api.server_state.server_components import JobContents, Service
from trunnion.service.api.transport.api_keys_and_rates import Caller
from trunnion.service.executor.part_file_format import CaseRange, CorruptPart, digest_of, document_bytes
from trunnion.service.executor.part_versions import shaped, with_version
from trunnion.service.request_models.job_request import plan_of_document
from trunnion.service.store.store_records import Chunk, Job
from trunnion.service.store.table_definitions import ENDED

log = logging.getLogger("trunnion.service")
POLL_SECONDS = 0.1
MOST_REPAIRS = 3
"""Largest number of times that the same cases are recomputed during one read. If more recomputations are needed, some fault damages
the parts repeatedly."""


def find_job(s: Service, job: str) -> Job:
    """The job with this id; Refusal (404) if there is none."""
    record = s.store.job(job) if job.isalnum() and job.isascii() and len(job) == 24 else None
    if record is None:
        raise Refusal(404, "no such job")
    return record


def find_own_job(s: Service, caller: Caller, job: str) -> Job:
    """The job with this id, if the caller may change the job. Callers may change their own jobs; the role admin may change any job.
    Refusal (403, 404) in all other cases."""
    record = find_job(s, job)
    if caller.role != "admin" and record.owner != caller.id:
        raise Refusal(403, "the job belongs to another key: only its owner or a key with the role admin may change it")
    return record


def job_contents(s: Service, job: str) -> JobContents:
    """The contents of an existing job, from the cache or the store."""

    def made() -> JobContents:
        document = s.store.document(job)
        plan, text = plan_of_document(document), document_bytes(document)
        return JobContents(plan, with_version(plan.schema), digest_of(text), text.decode())

    return s.contents.of(job, made)


def case_numbers(s: Service, job: str, case: int) -> dict[str, float]:
    """The parameter values of a case. Refusal (409) for a fit, and for a case of a study that has not run yet."""
    import pyarrow as pa

    plan, schema = job_contents(s, job).plan, job_contents(s, job).schema
    if isinstance(plan, FitPlan):
        raise Refusal(409, "a fit has no cases that could run again: submit the fitted values as cases of a new job")
    if not isinstance(plan.cases.values, ReportedCases):
        return plan.cases.changes(case)
    shown = pa.schema([schema.field(n) for n in plan.cases.paths])
    for table in result_rows(s, job, shown, case, case + 1):
        for row in table.to_pylist():
            return {path: float(value) for path, value in row.items()}
    raise Refusal(409, "the case has not run yet")


def trajectory_rows(s: Service, job: str, schema: Any, first: int, stop: int) -> Iterator[Any]:
    """Tables of the stored trajectory rows of the cases first … stop − 1. Damaged rows are recomputed as in ``result_rows``."""

    def read(case_range: CaseRange, low: int, high: int) -> Any:
        table = s.parts.read_rows(case_range, list(dict.fromkeys(["case", *schema.names])))
        case = table["case"].to_numpy()
        return table.filter((case >= low) & (case < high))

    yield from _part_tables(s, job, schema, first, stop, read)


def result_rows(s: Service, job: str, schema: Any, first: int, stop: int) -> Iterator[Any]:
    """Tables of the results of the cases first … stop − 1. If a part is damaged, the function waits until the cases of the part are
    recomputed. Raises CorruptPart when the recomputation fails."""

    def read(case_range: CaseRange, low: int, high: int) -> Any:
        return s.parts.read_part(case_range, schema.names)[0].slice(low - case_range.start, max(0, high - low))

    yield from _part_tables(s, job, schema, first, stop, read)


def _part_tables(
    s: Service, job: str, schema: Any, first: int, stop: int, read: Callable[[CaseRange, int, int], Any]
) -> Iterator[Any]:
    """The tables that ``read`` returns, one for each finished chunk."""
    digest = job_contents(s, job).digest
    todo, repairs = deque(s.store.finished(job, first, stop)), 0
    while todo:
        chunk = todo.popleft()
        try:
            low, high = max(first, chunk.start), min(stop, chunk.stop)
            table = read(CaseRange(job, digest, chunk.start, chunk.stop), low, high)
        except CorruptPart as e:
            repairs += 1
            if repairs > MOST_REPAIRS * (1 + len(todo)):
                raise
            todo.extendleft(reversed(recompute_chunk(s, chunk, str(e))))
            continue
        yield shaped(table, schema)


def recompute_chunk(s: Service, chunk: Chunk, why: str) -> list[Chunk]:
    """Request that the cases of a chunk are recomputed, and wait for the result. Returns the chunks that contain these cases after
    the recomputation. Cases are missing if the job does not continue (``reopen_chunk``)."""
    log.warning("job %s, cases %d to %d: %s; they are recomputed", chunk.job, chunk.start, chunk.stop - 1, why)
    s.store.reopen_chunk(chunk.job, chunk.start, why)
    s.metrics.chunks.labels("spoiled").inc()
    s.dispatcher.wake()
    end = time.monotonic() + s.settings.limits.answer_seconds
    while True:
        now = s.store.job(chunk.job)
        there = s.store.finished(chunk.job, chunk.start, chunk.stop)
        if sum(c.stop - c.start for c in there) == chunk.stop - chunk.start or now is None or now.state in ENDED:
            return there
        if time.monotonic() > end:
            raise CorruptPart(f"cases {chunk.start} to {chunk.stop - 1}: {why}; these rows are being recomputed: try again later")
        time.sleep(POLL_SECONDS)
