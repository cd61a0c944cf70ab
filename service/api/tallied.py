"""Answers to questions about very many cases, from the tallies beside their parts: each is read once, and what they come to is
kept, of a job that has ended beside its parts, too."""

from __future__ import annotations

import threading
from collections import OrderedDict, deque
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, Field

from engine.batch.tally import Tally, packed, tally_of, together, unpacked
from service.api.reading import MOST_REPAIRS, Known, again, known
from service.executor.sealed import Piece, Spoiled, digest_of, opened
from service.executor.tallied import AT_ONCE, MANY, is_tallied, tallies
from service.store.rows import Chunk

if TYPE_CHECKING:
    from service.api.service import Service

KEPT = 4
"""Jobs whose tallies are kept in memory: some hundred megabytes each, at most."""


class DrawnDocument(BaseModel):
    """Of which cases an answer is, where it is not of all."""

    cases: int = Field(description="Drawn by their numbers, as if by chance.")
    of: int = Field(description="Cases that are done.")


DRAWN = Field(None, description=f"null: the answer is of all cases. Of more than {MANY} some are drawn, a million or so.")


@dataclass
class Kept:
    """What is known of a job: of which pieces (start, stop), and what they come to."""

    lock: threading.Lock = field(default_factory=threading.Lock)
    pieces: set[tuple[int, int]] = field(default_factory=set)
    tally: Tally | None = None


@dataclass
class Tallies:
    """The jobs that were asked about of late."""

    jobs: OrderedDict[str, Kept] = field(default_factory=OrderedDict)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def of(self, job: str) -> Kept:
        """What is known of a job."""
        with self.lock:
            found = self.jobs.setdefault(job, Kept())
            self.jobs.move_to_end(job)
            while len(self.jobs) > KEPT:
                self.jobs.popitem(last=False)
            return found


def tallied(s: Service, job: str) -> Tally | None:
    """What the cases of a job that are done come to; None of a job that has so few that all rows are read. Spoiled where some
    cannot be had."""
    there = known(s, job)
    if not is_tallied(there.plan):
        return None
    kept = s.tallies.of(job)
    with kept.lock:
        chunks = s.store.finished(job)
        spans = {(c.start, c.stop): c for c in chunks}
        if not kept.pieces <= spans.keys():  # some were computed again
            kept.pieces, kept.tally = set(), None
        ended = sum(c.stop - c.start for c in chunks) == there.plan.cases.count and len(chunks) > AT_ONCE
        all_of = Piece(job, f"{there.digest} all {digest_of(repr(sorted(spans)).encode())}", 0, there.plan.cases.count)
        if ended and kept.tally is None:
            kept.tally = _read(s, all_of)
            kept.pieces = set(spans) if kept.tally is not None else set()
        fresh = [c for span, c in spans.items() if span not in kept.pieces]
        if fresh or kept.tally is None:
            _add(s, kept, there, fresh)
            if ended and kept.pieces == spans.keys() and kept.tally is not None:
                s.parts.write_table(s.parts.all_tally(job), all_of.of_tally, packed(kept.tally))
        return kept.tally


def _read(s: Service, all_of: Piece) -> Tally | None:
    """What was kept of a job that has ended."""
    try:
        return unpacked(opened(s.parts.read(s.parts.all_tally(all_of.job)), all_of.of_tally))
    except (Spoiled, FileNotFoundError):
        return None


def _add(s: Service, kept: Kept, there: Known, chunks: Iterable[Chunk]) -> None:
    """Add what some pieces come to; those that are spoilt are computed again, which is waited for."""
    todo, repairs = deque(chunks), 0
    found, pieces = [kept.tally] if kept.tally is not None else [], set(kept.pieces)
    while todo:
        some = {c.start: c for c in (todo.popleft() for _ in range(min(len(todo), AT_ONCE)))}
        for got in tallies(s.parts, [Piece(c.job, there.digest, c.start, c.stop) for c in some.values()], there.plan):
            if isinstance(got, Tally):
                found.append(got)
                continue
            repairs += 1
            if repairs > MOST_REPAIRS * (1 + len(todo)):
                raise Spoiled(f"cases {got.start} to {got.stop - 1} cannot be read")
            todo.extend(again(s, some.pop(got.start), "neither its rows nor its tally are what was written"))
        pieces |= {(c.start, c.stop) for c in some.values()}
        if len(found) >= AT_ONCE:
            found = [together(found, there.plan.cases)]
    nothing = tally_of(there.schema.empty_table(), there.plan.cases, there.plan.reductions)
    kept.tally, kept.pieces = together(found, there.plan.cases) if found else nothing, pieces


def drawn_of(tally: Tally | None) -> dict[str, Any] | None:
    """Of which cases an answer is, as a document."""
    return None if tally is None else {"cases": len(tally.drawn), "of": tally.cases}


def of_drawn(note: str, drawn: dict[str, Any] | None) -> dict[str, str]:
    """A note, with what is to be known where not all cases were drawn."""
    some = drawn is not None and drawn["cases"] < drawn["of"]
    return {"note": f"{note}; {drawn['cases']} of {drawn['of']} cases, drawn by chance" if some and drawn else note}


def rows_drawn(tally: Tally, shown: Any) -> Any:
    """The rows that were drawn, with the columns of a schema, in order of cases."""
    return tally.drawn.sort_by("case").select(shown.names).cast(shown)
