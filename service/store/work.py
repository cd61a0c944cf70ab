"""The server's side of the store: leases, chunks, attempts, ends. Every write names the lease it stands on."""

from __future__ import annotations

import json
import time
from dataclasses import dataclass, field
from typing import Any

from sqlalchemy import Connection, and_, case, func, insert, or_, select, update

from service.store.database import transaction
from service.store.rows import Chunk, Job, chunk_of, job_of
from service.store.store import Store
from service.store.tables import ACTIVE, attempts, chunks, jobs


class LeaseLost(RuntimeError):
    """Another server works on the job now: drop it, and write nothing."""


@dataclass(frozen=True)
class Done:
    """What a finished chunk reports: cases by outcome, seconds of stepping and of building, size of its part, where it ran."""

    counts: dict[str, int]
    seconds: float
    build_seconds: float
    bytes: int
    worker: str = ""
    extra: dict[str, Any] = field(default_factory=dict)


class WorkStore(Store):
    """Lease rules: ``claim`` gives this server every active job that nobody holds, and renews its own; between renewals at most
    ``lease`` seconds may pass. A server that lost a lease gets LeaseLost from its next write on that job and must forget it; what
    its workers still write are the same bytes under the same names, so no harm comes of it."""

    def claim(self, server: str, lease: float) -> list[Job]:
        """The jobs this server works on from now until ``lease`` seconds have passed."""
        now = time.time()
        with transaction(self.engine, writing=True) as c:
            mine = or_(jobs.c.lease_owner == server, jobs.c.lease_owner.is_(None), jobs.c.lease_until < now)
            c.execute(update(jobs).where(jobs.c.state.in_(ACTIVE), mine).values(lease_owner=server, lease_until=now + lease))
            held = select(jobs).where(jobs.c.state.in_(ACTIVE), jobs.c.lease_owner == server).order_by(jobs.c.created, jobs.c.id)
            return [job_of(row) for row in c.execute(held).mappings()]

    def release(self, server: str) -> None:
        """Give all leases back (a server that ends well)."""
        with transaction(self.engine, writing=True) as c:
            c.execute(update(jobs).where(jobs.c.lease_owner == server).values(lease_owner=None, lease_until=0.0))

    def _held(self, c: Connection, server: str, job: str) -> Any:
        """The job's row, locked; LeaseLost when another server has it."""
        row = c.execute(select(jobs).where(jobs.c.id == job).with_for_update()).mappings().one()
        if row["lease_owner"] != server or row["state"] not in ACTIVE:
            raise LeaseLost(job)
        return row

    def begin(self, server: str, job: str) -> None:
        """Record that a queued job is running now."""
        with transaction(self.engine, writing=True) as c:
            if self._held(c, server, job)["state"] == "queued":
                c.execute(update(jobs).where(jobs.c.id == job).values(state="running", started=time.time()))
                self._event(c, job, "started", {})

    def cut(self, server: str, job: str, size: int) -> Chunk | None:
        """The next chunk to run: one whose retry is due, else at most ``size`` new cases; None when there is none now."""
        now = time.time()
        with transaction(self.engine, writing=True) as c:
            row = self._held(c, server, job)
            due = and_(chunks.c.job == job, chunks.c.state == "waiting", chunks.c.not_before <= now)
            old = c.execute(select(chunks).where(due).order_by(chunks.c.start).limit(1)).mappings().first()
            if old is not None:
                at = and_(chunks.c.job == job, chunks.c.start == old["start"])
                c.execute(update(chunks).where(at).values(state="running", attempts=chunks.c.attempts + 1))
                start, stop = old["start"], old["stop"]
            elif row["planned"] < row["cases"]:
                start, stop = row["planned"], min(row["planned"] + size, row["cases"])
                c.execute(insert(chunks).values(job=job, start=start, stop=stop, state="running", attempts=1))
                c.execute(update(jobs).where(jobs.c.id == job).values(planned=stop))
            else:
                return None
            c.execute(insert(attempts).values(job=job, start=start, begun=now))
            found = c.execute(select(chunks).where(chunks.c.job == job, chunks.c.start == start)).mappings().one()
            return chunk_of(found)

    def running(self, job: str) -> list[Chunk]:
        """Chunks recorded as running; after a restart, nobody works on them any more."""
        query = select(chunks).where(chunks.c.job == job, chunks.c.state == "running").order_by(chunks.c.start)
        with transaction(self.engine) as c:
            return [chunk_of(row) for row in c.execute(query).mappings()]

    def finished(self, job: str) -> list[Chunk]:
        """Chunks whose parts are there, in order of their cases."""
        query = select(chunks).where(chunks.c.job == job, chunks.c.state == "done").order_by(chunks.c.start)
        with transaction(self.engine) as c:
            return [chunk_of(row) for row in c.execute(query).mappings()]

    def chunk_done(self, server: str, job: str, start: int, done: Done) -> None:
        """Record that a chunk's part is there. A report that comes twice counts once."""
        with transaction(self.engine, writing=True) as c:
            row = self._held(c, server, job)
            at = and_(chunks.c.job == job, chunks.c.start == start)
            if not c.execute(update(chunks).where(at, chunks.c.state != "done").values(state="done", error="")).rowcount:
                return
            counts = json.loads(row["counts"])
            for name, n in done.counts.items():
                counts[name] = counts.get(name, 0) + n
            sums = {
                "done": jobs.c.done + sum(done.counts.values()),
                "bytes": jobs.c.bytes + done.bytes,
                "seconds": jobs.c.seconds + done.seconds,
            }
            build = {"build_seconds": jobs.c.build_seconds + done.build_seconds}
            c.execute(update(jobs).where(jobs.c.id == job).values(counts=json.dumps(counts), **sums, **build))
            self._attempt_ended(c, job, start, done.worker, "done")

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
            values = {"state": state, "attempts": tried, "not_before": time.time() + delay, "error": error[:2000]}
            c.execute(update(chunks).where(at).values(values))
            self._attempt_ended(c, job, start, "", error)
            about = {"first_case": row["start"], "last_case": row["stop"] - 1, "attempt": tried, "error": error[:300]}
            if state == "failed":
                c.execute(update(jobs).where(jobs.c.id == job).values(lost=jobs.c.lost + row["stop"] - row["start"]))
            self._event(c, job, "chunk_failed" if state == "failed" else "chunk_retried", about)
            return state

    def _attempt_ended(self, c: Connection, job: str, start: int, worker: str, result: str) -> None:
        last = select(func.max(attempts.c.id)).where(attempts.c.job == job, attempts.c.start == start).scalar_subquery()
        c.execute(
            update(attempts).where(attempts.c.id == last).values(ended=time.time(), worker=worker[:255], result=result[:2000])
        )

    def attempts(self, job: str) -> list[dict[str, Any]]:
        """Every attempt at a chunk of the job, in order."""
        query = select(attempts).where(attempts.c.job == job).order_by(attempts.c.id)
        with transaction(self.engine) as c:
            return [dict(row) for row in c.execute(query).mappings()]

    def end_if_over(self, server: str, job: str) -> str | None:
        """Close a job all of whose cases are done or lost; its final state, None while it goes on."""
        with transaction(self.engine, writing=True) as c:
            row = self._held(c, server, job)
            if row["done"] + row["lost"] < row["cases"]:
                return None
            if not row["lost"]:
                return self._end(c, job, "done", [])
            failed = select(chunks).where(chunks.c.job == job, chunks.c.state == "failed").order_by(chunks.c.start).limit(20)
            problems = [
                {
                    "where": f"cases {r['start']} to {r['stop'] - 1}",
                    "what": f"could not be run in {r['attempts']} attempts: {r['error']}",
                    "hint": "the other cases' results stand; submit these again when the cause is gone",
                }
                for r in c.execute(failed).mappings()
            ]
            return self._end(c, job, "failed", problems)

    def end(self, server: str, job: str, state: str, problems: list[dict[str, Any]]) -> None:
        """Close a job early: cancelled, or out of its budget."""
        with transaction(self.engine, writing=True) as c:
            self._held(c, server, job)
            over = case((chunks.c.state == "done", "done"), (chunks.c.state == "failed", "failed"), else_="dropped")
            c.execute(update(chunks).where(chunks.c.job == job).values(state=over))
            self._end(c, job, state, problems)

    def _end(self, c: Connection, job: str, state: str, problems: list[dict[str, Any]]) -> str:
        values = {
            "state": state,
            "finished": time.time(),
            "problems": json.dumps(problems),
            "lease_owner": None,
            "lease_until": 0.0,
        }
        c.execute(update(jobs).where(jobs.c.id == job).values(values))
        self._event(c, job, state, {"problems": problems})
        return state
