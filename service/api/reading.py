"""Reading what jobs have kept: what is known of a job, and the rows of its parts, each checked as it is read."""

from __future__ import annotations

import logging
import threading
import time
from collections import OrderedDict, deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from engine.fits.cases import FitPlan
from engine.studies.following import Follow, Study, Told
from service.api.problems import Refusal
from service.executor.sealed import Piece, Spoiled, digest_of, document_bytes
from service.request import plan_of_document
from service.store.rows import Chunk
from service.store.tables import ENDED

if TYPE_CHECKING:
    from engine.batch.plan import Plan
    from service.api.service import Service

log = logging.getLogger("trunnion.service")
KEPT = 64
LOOK_SECONDS = 0.1
MOST_REPAIRS = 3
"""How often one reading has the same cases computed again before it gives up: something goes on spoiling them."""


@dataclass(frozen=True)
class Known:
    """What a job's document says, which never changes: its plan, the schema of its table, the document's digest and text."""

    plan: Plan
    schema: Any
    digest: str
    text: str


@dataclass
class Library:
    """The jobs that were read of late."""

    jobs: OrderedDict[str, Known] = field(default_factory=OrderedDict)
    lock: threading.Lock = field(default_factory=threading.Lock)
    follows: OrderedDict[str, Follow] = field(default_factory=OrderedDict)
    following: threading.Lock = field(default_factory=threading.Lock)

    def follow(self, job: str, study: Callable[[], Study | None]) -> Follow | None:
        """The study of a job, as far as it was followed here; None where it is none."""
        with self.following:
            if job not in self.follows:
                made = study()
                if made is None:
                    return None
                self.follows[job] = Follow(made)
                while len(self.follows) > KEPT:
                    self.follows.popitem(last=False)
            return self.follows[job]


def known(s: Service, job: str) -> Known:
    """What is known of a job; it must exist."""
    with s.library.lock:
        if job in s.library.jobs:
            s.library.jobs.move_to_end(job)
            return s.library.jobs[job]
    document = s.store.document(job)
    plan = plan_of_document(document)
    text = document_bytes(document)
    made = Known(plan, plan.schema, digest_of(text), text.decode())
    with s.library.lock:
        s.library.jobs[job] = made
        while len(s.library.jobs) > KEPT:
            s.library.jobs.popitem(last=False)
    return made


def changes_of(s: Service, job: str, case: int) -> dict[str, float]:
    """The numbers of a case; Refusal (409) for one of a study that is not there yet, and for a fit."""
    import pyarrow as pa

    plan, schema = known(s, job).plan, known(s, job).schema
    if isinstance(plan, FitPlan):
        raise Refusal(409, "the job is a fit, which has no cases to run again: submit the numbers it found as cases")
    if not isinstance(plan.cases.values, Told):
        return plan.cases.changes(case)
    shown = pa.schema([schema.field(n) for n in plan.cases.paths])
    for table in rows(s, job, shown, case, case + 1):
        for row in table.to_pylist():
            return {path: float(value) for path, value in row.items()}
    raise Refusal(409, "the case is not there yet")


def kept_rows(s: Service, job: str, schema: Any, first: int, stop: int) -> Iterator[Any]:
    """The tables of the rows that are kept, cut to the cases wanted; what was spoilt is computed again as by ``rows``."""

    def read(piece: Piece, low: int, high: int) -> Any:
        table = s.parts.read_rows(piece, list(dict.fromkeys(["case", *schema.names])))
        case = table["case"].to_numpy()
        return table.filter((case >= low) & (case < high))

    yield from _tables(s, job, schema, first, stop, read)


def rows(s: Service, job: str, schema: Any, first: int, stop: int) -> Iterator[Any]:
    """The tables of the parts, cut to the cases wanted. A part that is not what was written is computed again, which is waited for;
    Spoiled when that comes to nothing."""

    def read(piece: Piece, low: int, high: int) -> Any:
        return s.parts.read_part(piece, schema.names)[0].slice(low - piece.start, max(0, high - low))

    yield from _tables(s, job, schema, first, stop, read)


def _tables(s: Service, job: str, schema: Any, first: int, stop: int, read: Callable[[Piece, int, int], Any]) -> Iterator[Any]:
    """What is read of each part that is there."""
    digest = known(s, job).digest
    todo, repairs = deque(s.store.finished(job, first, stop)), 0
    while todo:
        chunk = todo.popleft()
        try:
            low, high = max(first, chunk.start), min(stop, chunk.stop)
            table = read(Piece(job, digest, chunk.start, chunk.stop), low, high)
        except Spoiled as e:
            repairs += 1
            if repairs > MOST_REPAIRS * (1 + len(todo)):
                raise
            todo.extendleft(reversed(again(s, chunk, str(e))))
            continue
        yield table.select(schema.names).cast(schema)


def again(s: Service, chunk: Chunk, why: str) -> list[Chunk]:
    """Have the cases of a chunk computed again; the chunks that hold them then, fewer where the job does not go on."""
    log.warning("job %s, cases %d to %d: %s; they are computed again", chunk.job, chunk.start, chunk.stop - 1, why)
    s.store.reopen(chunk.job, chunk.start, why)
    s.metrics.chunks.labels("spoiled").inc()
    s.dispatcher.wake()
    end = time.monotonic() + s.settings.limits.answer_seconds
    while True:
        now = s.store.job(chunk.job)
        there = s.store.finished(chunk.job, chunk.start, chunk.stop)
        if sum(c.stop - c.start for c in there) == chunk.stop - chunk.start or now is None or now.state in ENDED:
            return there
        if time.monotonic() > end:
            raise Spoiled(f"cases {chunk.start} to {chunk.stop - 1}: {why}; they are being computed again: try later")
        time.sleep(LOOK_SECONDS)
