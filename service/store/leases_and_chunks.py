"""The part of the store for running jobs: leases, chunks, attempts, ends of jobs. Every write requires the lease of the job."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import replace
from hashlib import sha256
from typing import Any

from sqlalchemy import Connection, and_, case, insert, or_, select, update

from trunnion.service.store.chunk_outcomes import OVERRAN, ChunkOutcomeStore
from trunnion.service.store.database_connection import transaction
from trunnion.service.store.job_and_chunk_records import Chunk, Job, record_of
from trunnion.service.store.table_definitions import ACTIVE, attempts, chunks, jobs


class WorkStore(ChunkOutcomeStore):
    """The store with leases of jobs. ``claim`` leases to a server all active jobs without a lease, and renews the server's leases.
    A server must call ``claim`` again within ``lease`` seconds. A lease expires by the clock of the database. It also expires if
    another server, by its own monotonic clock, sees no renewal for the lease's duration. Therefore a database clock that is set
    back blocks no job. A server that lost its lease gets LeaseLost and must drop the job. Its workers may still write, because they
    write the same rows to the same files."""

    def __init__(self, url: str):
        super().__init__(url)
        self.seen: dict[str, tuple[tuple[str, int], float]] = {}

    def claim(self, server: str, lease: float) -> list[Job]:
        """Lease all free jobs to a server for ``lease`` seconds, and renew its leases. Returns all jobs that the server leases."""
        with transaction(self.engine, writing=True) as c:
            now = self.now(c)
            free = or_(jobs.c.lease_owner == server, jobs.c.lease_owner.is_(None), jobs.c.lease_until < now)
            mine = or_(free, jobs.c.id.in_(self._stale(c, server)))
            renewed = {"lease_owner": server, "lease_until": now + lease, "beat": jobs.c.beat + 1, "lease": lease}
            c.execute(update(jobs).where(jobs.c.state.in_(ACTIVE), mine).values(renewed))
            held = select(jobs).where(jobs.c.state.in_(ACTIVE), jobs.c.lease_owner == server).order_by(jobs.c.created, jobs.c.id)
            return [record_of(Job, row) for row in c.execute(held).mappings()]

    def _stale(self, c: Connection, server: str) -> list[str]:
        """The jobs of other servers whose leases were not renewed for longer than their duration, as observed by this server."""
        query = select(jobs.c.id, jobs.c.lease_owner, jobs.c.beat, jobs.c.lease)
        others = c.execute(query.where(jobs.c.state.in_(ACTIVE), jobs.c.lease_owner != server)).all()
        now, seen, found = time.monotonic(), {}, []
        for job, owner, beat, lasts in others:
            mark = (owner, beat)
            before = self.seen.get(job)
            seen[job] = before if before is not None and before[0] == mark else (mark, now)
            if now - seen[job][1] > lasts:
                found.append(job)
        self.seen = seen
        return found

    def release(self, server: str) -> None:
        """Release all leases of a server."""
        with transaction(self.engine, writing=True) as c:
            c.execute(update(jobs).where(jobs.c.lease_owner == server).values(lease_owner=None, lease_until=0.0))

    def begin(self, server: str, job: str) -> None:
        """Store that a job is running. If the job is resumed, the time of the interruption does not affect its pace."""
        with transaction(self.engine, writing=True) as c:
            row, now = self._locked_job(c, server, job), self.now(c)
            if row["state"] == "queued":
                c.execute(update(jobs).where(jobs.c.id == job).values(state="running", started=now))
                self._event(c, job, "started", {})
            elif row["landed"] is not None:
                c.execute(update(jobs).where(jobs.c.id == job).values(landed=now))

    def cut_chunks(self, server: str, job: str, sizes: Sequence[int], pause: float = 3000.0) -> list[Chunk]:
        """Cut and store the next chunks to run, at most one for each element of ``sizes``, in one transaction. Retries that are due
        come first, then new cases (at most ``sizes[k]`` in chunk k), then cases that took too long."""
        with transaction(self.engine, writing=True) as c:
            row, now = self._locked_job(c, server, job), self.now(c)
            due = self._due(c, job, now, pause, len(sizes))
            again = [x for x in due if x.error != OVERRAN]
            fresh, start, known = [], row["planned"], row["cases"] if row["asked"] is None else row["asked"]
            for size in sizes[len(again) :]:
                if start < known:
                    fresh.append(Chunk(job, start, min(start + size, known), "running", 1, 0.0, ""))
                    start = fresh[-1].stop
            last = [x for x in due if x.error == OVERRAN and start >= known][: len(sizes) - len(again) - len(fresh)]
            if again or last:
                those = and_(chunks.c.job == job, chunks.c.start.in_([x.start for x in again + last]))
                c.execute(update(chunks).where(those).values(state="running", attempts=chunks.c.attempts + 1))
            if fresh:
                new = [{"job": job, "start": x.start, "stop": x.stop, "state": "running", "attempts": 1} for x in fresh]
                c.execute(insert(chunks), new)
                c.execute(update(jobs).where(jobs.c.id == job).values(planned=start))
            again, last = ([replace(x, state="running", attempts=x.attempts + 1) for x in some] for some in (again, last))
            cut = again + fresh + last
            if cut:
                c.execute(insert(attempts), [{"job": job, "start": x.start, "begun": now} for x in cut])
            return cut

    @staticmethod
    def _due(c: Connection, job: str, now: float, pause: float, most: int) -> list[Chunk]:
        """The waiting chunks that are due; chunks with cases that overran come last. A chunk whose ``not_before`` is more than
        ``pause`` seconds ahead is also due, because the clock must have been set back."""
        over = or_(chunks.c.not_before <= now, chunks.c.not_before > now + pause)
        last = case((chunks.c.error == OVERRAN, 1), else_=0)
        due = select(chunks).where(chunks.c.job == job, chunks.c.state == "waiting", over).order_by(last, chunks.c.start)
        return [record_of(Chunk, row) for row in c.execute(due.limit(most)).mappings()]

    def running(self, job: str) -> list[Chunk]:
        """The chunks that are stored as running. After a restart of the server, they do not actually run."""
        query = select(chunks).where(chunks.c.job == job, chunks.c.state == "running").order_by(chunks.c.start)
        return self._all(query, Chunk)

    def ended(self, job: str, start: int, stop: int) -> list[Chunk]:
        """The chunks that contain any of the cases start … stop − 1 and are done or have failed in all attempts."""
        here = and_(chunks.c.job == job, chunks.c.start < stop, chunks.c.stop > start, chunks.c.state.in_(("done", "failed")))
        return self._all(select(chunks).where(here).order_by(chunks.c.start), Chunk)

    def finished(self, job: str, first: int = 0, stop: int | None = None) -> list[Chunk]:
        """The finished chunks, in order, that contain any of the cases first … stop − 1. stop: None means the end of the job."""
        query = select(chunks).where(chunks.c.job == job, chunks.c.state == "done", chunks.c.stop > first).order_by(chunks.c.start)
        return self._all(query if stop is None else query.where(chunks.c.start < stop), Chunk)

    def ends(self, job: str) -> str:
        """The digest (SHA-256) of the list of ends of the finished chunks, in order."""
        with transaction(self.engine) as c:
            return self._ends(c, job)

    @staticmethod
    def _ends(c: Connection, job: str) -> str:
        query = select(chunks.c.stop).where(chunks.c.job == job, chunks.c.state == "done").order_by(chunks.c.start)
        return sha256(json.dumps([int(stop) for stop in c.execute(query).scalars()]).encode()).hexdigest()

    def ask(self, server: str, job: str, known: int, over: bool) -> None:
        """Store the number of known cases of a study. over: whether the number is final."""
        with transaction(self.engine, writing=True) as c:
            self._locked_job(c, server, job)
            values = {"asked": known} | ({"cases": known} if over else {})
            c.execute(update(jobs).where(jobs.c.id == job).values(values))

    def end_if_over(self, server: str, job: str) -> str | None:
        """End a job if all its cases are done or lost. Returns its final state, or None if the job continues."""
        with transaction(self.engine, writing=True) as c:
            row = self._locked_job(c, server, job)
            if row["done"] + row["lost"] < row["cases"]:
                return None
            if not row["lost"]:
                return self._end(c, job, "done", [])
            failed = select(chunks).where(chunks.c.job == job, chunks.c.state == "failed").order_by(chunks.c.start).limit(20)
            problems = [
                {
                    "where": f"cases {r['start']} to {r['stop'] - 1}",
                    "what": f"could not be run in {r['attempts']} attempts: {r['error']}",
                    "hint": "results of other cases are valid; submit these cases again when the cause is fixed",
                }
                for r in c.execute(failed).mappings()
            ]
            return self._end(c, job, "failed", problems)

    def end(self, server: str, job: str, state: str, problems: list[dict[str, Any]]) -> None:
        """End a job early, because it was cancelled or its budget is used up."""
        with transaction(self.engine, writing=True) as c:
            self._locked_job(c, server, job)
            over = case((chunks.c.state == "done", "done"), (chunks.c.state == "failed", "failed"), else_="dropped")
            c.execute(update(chunks).where(chunks.c.job == job).values(state=over))
            self._end(c, job, state, problems)

    def _end(self, c: Connection, job: str, state: str, problems: list[dict[str, Any]]) -> str:
        values = {
            "state": state,
            "finished": self.now(c),
            "problems": json.dumps(problems),
            "lease_owner": None,
            "lease_until": 0.0,
            "ends": self._ends(c, job) if state == "done" else "",
        }
        c.execute(update(jobs).where(jobs.c.id == job).values(values))
        self._event(c, job, state, {"problems": problems})
        self._queue_webhook(c, job, state)
        return state
