"""What becomes of chunks: done, done in part and split, lost. Every write names the lease it stands on."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

from sqlalchemy import Connection, and_, func, insert, or_, select, update

from service.store.database import transaction
from service.store.hooks import HookStore
from service.store.tables import ACTIVE, attempts, chunks, jobs

RECENT = 0.25
"""Least weight of the newest rows in a job's pace: how fast what happened long ago is forgotten."""

OVERRAN = "it overran"
"""Of a waiting case: others go before it."""


class LeaseLost(RuntimeError):
    """Another server works on the job now: drop it, and write nothing."""


@dataclass(frozen=True)
class Done:
    """What a chunk reports that came back: cases by outcome, seconds of stepping and of building, size of its part, where it ran.
    reached: the case up to which it came (None: all); those from there on are still to be run."""

    counts: dict[str, int]
    seconds: float
    build_seconds: float
    bytes: int
    worker: str = ""
    extra: dict[str, Any] = field(default_factory=dict)
    reached: int | None = None


class LandingStore(HookStore):
    """The part of the server's side that is about single chunks."""

    def _held(self, c: Connection, server: str, job: str) -> Any:
        """The job's row, locked; LeaseLost when another server has it."""
        row = c.execute(select(jobs).where(jobs.c.id == job).with_for_update()).mappings().one()
        if row["lease_owner"] != server or row["state"] not in ACTIVE:
            raise LeaseLost(job)
        return row

    def chunk_done(self, server: str, job: str, start: int, done: Done) -> None:
        """Record that a chunk's part is there, whole or up to ``done.reached``. A report that comes twice counts once."""
        with transaction(self.engine, writing=True) as c:
            row = self._held(c, server, job)
            at = and_(chunks.c.job == job, chunks.c.start == start)
            chunk = c.execute(select(chunks).where(at)).mappings().one()
            if chunk["state"] == "done":
                return
            self._spent(c, row, done)
            stop = chunk["stop"] if done.reached is None else done.reached
            if stop > start:
                what = {"state": "done", "stop": stop, "error": "", "counts": json.dumps(done.counts), "bytes": done.bytes}
                c.execute(update(chunks).where(at).values(what))
            self._split(c, job, chunk, stop)
            self._attempt_ended(c, job, start, done.worker, "done" if stop == chunk["stop"] else f"overran at case {stop}")

    def _spent(self, c: Connection, row: Any, done: Done) -> None:
        """Add what a chunk reports to its job's sums, and to what is known of its pace."""
        counts, n = Counter(json.loads(row["counts"])) + Counter(done.counts), sum(done.counts.values())
        values: dict[str, Any] = {
            "done": jobs.c.done + n,
            "bytes": jobs.c.bytes + done.bytes,
            "seconds": jobs.c.seconds + done.seconds,
            "build_seconds": jobs.c.build_seconds + done.build_seconds,
            "counts": json.dumps(counts),
        }
        now = self.now(c)
        since = row["landed"] or row["started"]
        if n and since is not None and now >= since:
            taken = max(0.0, now - since - done.build_seconds) / n
            weight = max(RECENT, n / (row["done"] + n)) if row["pace"] else 1.0
            values |= {"pace": row["pace"] + weight * (taken - row["pace"])}
        if n:
            values["landed"] = now
        c.execute(update(jobs).where(jobs.c.id == row["id"]).values(values))

    def _split(self, c: Connection, job: str, chunk: Any, reached: int) -> None:
        """What a chunk that overran has left waits: the case it was at alone, the others in two pieces."""
        stop = chunk["stop"]
        if reached >= stop:
            return
        middle = reached + 1 + (stop - reached) // 2
        for low, high in ((reached, reached + 1), (reached + 1, min(middle, stop)), (min(middle, stop), stop)):
            values = {"stop": high, "state": "waiting", "attempts": 0, "not_before": 0.0}
            values["error"] = OVERRAN if low == reached else ""
            if low == chunk["start"]:
                c.execute(update(chunks).where(chunks.c.job == job, chunks.c.start == low).values(values))
            elif low < high:
                c.execute(insert(chunks).values(values | {"job": job, "start": low}))
        self._event(c, job, "chunk_split", {"first_case": chunk["start"], "last_case": stop - 1, "overran": reached})

    def chunk_lost(self, server: str, job: str, start: int, error: str, most: int, delay: float, blame: bool = True) -> str:
        """Record an attempt that came to nothing: the chunk waits ``delay`` seconds for the next one, or has failed after ``most``.
        Without ``blame`` (the scheduler went away, the server was restarted) it is not counted. Returns the chunk's state."""
        with transaction(self.engine, writing=True) as c:
            self._held(c, server, job)
            at = and_(chunks.c.job == job, chunks.c.start == start)
            row = c.execute(select(chunks).where(at)).mappings().one()
            if row["state"] != "running":
                return str(row["state"])
            tried = row["attempts"] if blame else max(0, row["attempts"] - 1)
            state = "failed" if tried >= most else "waiting"
            values = {"state": state, "attempts": tried, "not_before": self.now(c) + delay, "error": error[:2000]}
            c.execute(update(chunks).where(at).values(values))
            self._attempt_ended(c, job, start, "", error)
            about = {"first_case": row["start"], "last_case": row["stop"] - 1, "attempt": tried, "error": error[:300]}
            if state == "failed":
                c.execute(update(jobs).where(jobs.c.id == job).values(lost=jobs.c.lost + row["stop"] - row["start"]))
            self._event(c, job, "chunk_failed" if state == "failed" else "chunk_retried", about)
            return state

    def reopen(self, job: str, start: int, why: str) -> None:
        """The part of a chunk that is done cannot be read back: its cases are to be computed again, with those of other chunks of
        which nothing is known. A job that ended goes on for them, but for one that was cancelled or is out of its budget: there the
        cases are gone, and its problems say so."""
        with transaction(self.engine, writing=True) as c:
            row = c.execute(select(jobs).where(jobs.c.id == job).with_for_update()).mappings().one()
            done = and_(chunks.c.job == job, chunks.c.state == "done")
            if c.execute(select(chunks.c.start).where(done, chunks.c.start == start)).first() is None:
                return
            known = row["cases"] if row["asked"] is None else row["asked"]
            goes_on = (row["state"] != "cancelled" and row["planned"] >= known) or row["state"] in ACTIVE
            values = {"state": "waiting" if goes_on else "dropped", "attempts": 0, "not_before": 0.0, "error": why[:2000]}
            c.execute(update(chunks).where(done, or_(chunks.c.start == start, chunks.c.counts == "")).values(values))
            self._summed(c, row)
            if goes_on and row["state"] not in ACTIVE:
                free = {"state": "running", "finished": None, "problems": "[]", "lease_owner": None, "lease_until": 0.0}
                c.execute(update(jobs).where(jobs.c.id == job).values(free))
            elif not goes_on:
                told = {"where": f"cases from {start}", "what": f"the rows kept are gone: {why}", "hint": "submit these again"}
                c.execute(update(jobs).where(jobs.c.id == job).values(problems=json.dumps([*json.loads(row["problems"]), told])))
            self._event(c, job, "part_spoiled", {"first_case": start, "why": why[:300], "computed_again": bool(goes_on)})

    def _summed(self, c: Connection, row: Any) -> None:
        """Give a job the sums of its chunks that are done; what the others have cost does not count against its budget."""
        query = select(chunks.c.start, chunks.c.stop, chunks.c.counts, chunks.c.bytes)
        there = c.execute(query.where(chunks.c.job == row["id"], chunks.c.state == "done")).all()
        counts: Counter[str] = sum((Counter(json.loads(x.counts)) for x in there), Counter())
        n = sum(x.stop - x.start for x in there)
        seconds = row["seconds"] * n / max(row["done"], 1)
        values = {"done": n, "counts": json.dumps(counts), "bytes": sum(x.bytes for x in there), "seconds": seconds}
        c.execute(update(jobs).where(jobs.c.id == row["id"]).values(values))

    def _attempt_ended(self, c: Connection, job: str, start: int, worker: str, result: str) -> None:
        last = select(func.max(attempts.c.id)).where(attempts.c.job == job, attempts.c.start == start).scalar_subquery()
        told = {"ended": self.now(c), "worker": worker[:255], "result": result[:2000]}
        c.execute(update(attempts).where(attempts.c.id == last).values(told))

    def attempts(self, job: str) -> list[dict[str, Any]]:
        """Every attempt at a chunk of the job, in order."""
        query = select(attempts).where(attempts.c.job == job).order_by(attempts.c.id)
        with transaction(self.engine) as c:
            return [dict(row) for row in c.execute(query).mappings()]
