"""The part of the store for running jobs: leases, chunks and their outcomes, attempts, ends of jobs. Every write requires the lease
of the job."""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from typing import Any

from sqlalchemy import Connection, and_, bindparam, case, insert, or_, select, update

from trunnion.service.store import frequent_statements as sql
from trunnion.service.store.database_connection import transaction
from trunnion.service.store.job_store import Store
from trunnion.service.store.store_records import Chunk, Job, record_of
from trunnion.service.store.table_definitions import ACTIVE, attempts, chunks, jobs

RECENT = 0.25
"""Smallest weight of the newest rows in the pace of a job, which is a weighted mean."""
OVERRAN = "it overran"
"""Error text of a waiting chunk whose case took too long. All other cases run before such a chunk."""
CHANGED = "rows_changed"
"""Kind of an event: another version computed rows again, because their part was damaged."""


class LeaseLost(RuntimeError):
    """Another server has the lease of the job. This server must not write anything more about the job."""


@dataclass(frozen=True)
class ChunkReport:
    """The report of a chunk. counts: number of cases by outcome. seconds, build_seconds: time of stepping and of building, s.
    bytes: size of the part. reached: number of the first unfinished case, None if all cases are finished. Cases from ``reached`` on
    must still run. version: version that computed the rows, "" if unknown."""

    counts: dict[str, int]
    seconds: float
    build_seconds: float
    bytes: int
    worker: str = ""
    reached: int | None = None
    version: str = ""


@dataclass(frozen=True)
class FailedAttempt:
    """A failed attempt. delay: time until the next attempt, s. blame: whether the attempt counts towards the limit of attempts."""

    error: str
    delay: float
    blame: bool = True


class WorkStore(Store):
    """The store with leases of jobs. ``claim`` leases to a server all active jobs without a lease, and renews the server's leases.
    A server must call ``claim`` again within ``lease`` seconds. A lease expires by the clock of the database. A lease also expires
    if another server, by its own monotonic clock, sees no renewal for the lease's duration. Therefore no job is blocked if the
    clock of the database is set back. A server that lost its lease gets LeaseLost and must drop the job. The server's workers may
    still write, because all servers write the same rows to the same files."""

    def __init__(self, url: str):
        super().__init__(url)
        self.seen: dict[str, tuple[tuple[str, int], float]] = {}

    def claim(self, server: str, lease: float) -> list[Job]:
        """Lease all free jobs to a server for ``lease`` seconds, and renew the server's leases. Returns all jobs that the server
        leases."""
        with transaction(self.engine, writing=True) as c:
            now = self.now(c)
            free = or_(jobs.c.lease_owner == server, jobs.c.lease_owner.is_(None), jobs.c.lease_until < now)
            mine = or_(free, jobs.c.id.in_(self._stale(c, server)))
            renewed = {"lease_owner": server, "lease_until": now + lease, "beat": jobs.c.beat + 1, "lease": lease}
            c.execute(update(jobs).where(jobs.c.state.in_(ACTIVE), mine).values(renewed))
            return [record_of(Job, row) for row in c.execute(sql.HELD_JOBS, {"of_server": server}).mappings()]

    def _stale(self, c: Connection, server: str) -> list[str]:
        """The jobs of other servers whose leases were not renewed for longer than their duration, as observed by this server."""
        others = c.execute(sql.LEASES_OF_OTHERS, {"of_server": server}).all()
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
            self._begin(c, self._locked_job(c, server, job), self.now(c))

    def _begin(self, c: Connection, row: Any, now: float) -> None:
        if row["state"] == "queued":
            c.execute(sql.CHANGE_JOB, {"of_job": row["id"], "state": "running", "started": now})
            self._event(c, row["id"], "started", {})
        elif row["landed"] is not None:
            c.execute(update(jobs).where(jobs.c.id == row["id"]).values(landed=now))

    def cut_chunks(self, server: str, job: str, sizes: Sequence[int], pause: float = 3000.0) -> list[Chunk]:
        """Cut and store the next chunks to run (at most ``len(sizes)``) and start a queued job in one transaction. Due retries come
        first, then new cases (at most ``sizes[k]`` in chunk k), then cases that took too long."""
        with transaction(self.engine, writing=True) as c:
            row, now = self._locked_job(c, server, job), self.now(c)
            if row["state"] == "queued":
                self._begin(c, row, now)
            due = self._due(c, job, now, pause, len(sizes)) if row["planned"] else []
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
                c.execute(sql.ADD_CHUNKS, new)
                c.execute(sql.CHANGE_JOB, {"of_job": job, "planned": start})
            again, last = ([replace(x, state="running", attempts=x.attempts + 1) for x in some] for some in (again, last))
            cut = again + fresh + last
            if cut:
                c.execute(sql.ADD_ATTEMPTS, [{"job": job, "start": x.start, "begun": now} for x in cut])
            return cut

    @staticmethod
    def _due(c: Connection, job: str, now: float, pause: float, most: int) -> list[Chunk]:
        """The waiting chunks that are due. Chunks whose cases took too long come last. A chunk whose ``not_before`` is more than
        ``pause`` seconds ahead is also due, because the clock must have been set back."""
        over = or_(chunks.c.not_before <= now, chunks.c.not_before > now + pause)
        last = case((chunks.c.error == OVERRAN, 1), else_=0)
        due = select(chunks).where(chunks.c.job == job, chunks.c.state == "waiting", over).order_by(last, chunks.c.start)
        return [record_of(Chunk, row) for row in c.execute(due.limit(most)).mappings()]

    def running(self, job: str) -> list[Chunk]:
        """The chunks that are stored as running. After a restart of the server, these chunks do not run, although they are stored
        as running."""
        return self._all(sql.RUNNING_CHUNKS, Chunk, of_job=job)

    def ended(self, job: str, start: int, stop: int) -> list[Chunk]:
        """The chunks that contain any of the cases start … stop − 1 and are done or have failed in all attempts."""
        here = and_(chunks.c.job == job, chunks.c.start < stop, chunks.c.stop > start, chunks.c.state.in_(("done", "failed")))
        return self._all(select(chunks).where(here).order_by(chunks.c.start), Chunk)

    def finished(self, job: str, first: int = 0, stop: int | None = None) -> list[Chunk]:
        """The finished chunks, in order, that contain any of the cases first … stop − 1. stop: None means the end of the job."""
        query = select(chunks).where(chunks.c.job == job, chunks.c.state == "done", chunks.c.stop > first).order_by(chunks.c.start)
        return self._all(query if stop is None else query.where(chunks.c.start < stop), Chunk)

    def ends(self, job: str) -> str:
        """The digest (SHA-256) of the ends and versions of the finished chunks, in order."""
        with transaction(self.engine) as c:
            return self._ends(c, job)

    @staticmethod
    def _ends(c: Connection, job: str) -> str:
        ends = c.execute(sql.CHUNK_ENDS, {"of_job": job})
        return sha256(json.dumps([[int(stop), version] for stop, version in ends]).encode()).hexdigest()

    def ask(self, server: str, job: str, known: int, over: bool) -> None:
        """Store the number of known cases of a study. over: whether the number is final."""
        with transaction(self.engine, writing=True) as c:
            self._locked_job(c, server, job)
            values = {"asked": known} | ({"cases": known} if over else {})
            c.execute(update(jobs).where(jobs.c.id == job).values(values))

    def end_if_over(self, server: str, job: str) -> str | None:
        """End a job if all its cases are done or lost. Returns its final state, or None if the job continues."""
        with transaction(self.engine, writing=True) as c:
            return self._end_if_over(c, self._locked_job(c, server, job))

    def _end_if_over(self, c: Connection, row: Any) -> str | None:
        """The result of ``end_if_over``. row: the row of the locked job."""
        if row["done"] + row["lost"] < row["cases"]:
            return None
        if not row["lost"]:
            return self._end(c, row, "done", [])
        failed = select(chunks).where(chunks.c.job == row["id"], chunks.c.state == "failed").order_by(chunks.c.start).limit(20)
        problems = [
            {
                "where": f"cases {r['start']} to {r['stop'] - 1}",
                "what": f"could not be run in {r['attempts']} attempts: {r['error']}",
                "hint": "results of other cases are valid; submit these cases again when the cause is fixed",
            }
            for r in c.execute(failed).mappings()
        ]
        return self._end(c, row, "failed", problems)

    def end(self, server: str, job: str, state: str, problems: list[dict[str, Any]]) -> None:
        """End a job early, because it was cancelled or its budget is used up."""
        with transaction(self.engine, writing=True) as c:
            row = self._locked_job(c, server, job)
            over = case((chunks.c.state == "done", "done"), (chunks.c.state == "failed", "failed"), else_="dropped")
            c.execute(update(chunks).where(chunks.c.job == job).values(state=over))
            self._end(c, row, state, problems)

    def _end(self, c: Connection, row: Any, state: str, problems: list[dict[str, Any]]) -> str:
        """End a job. A job that continued in order to repair a part keeps the time of its first end."""
        job = row["id"]
        problems = [*self._changes(c, job), *problems]
        values = {
            "of_job": job,
            "state": state,
            "finished": self.now(c) if row["finished"] is None else row["finished"],
            "problems": json.dumps(problems),
            "lease_owner": None,
            "lease_until": 0.0,
            "ends": self._ends(c, job) if state == "done" else "",
        }
        c.execute(sql.CHANGE_JOB, values)
        self._event(c, job, state, {"problems": problems})
        if row["notify"]:
            self._queue_webhook(c, job, state)
        return state

    @staticmethod
    def _changes(c: Connection, job: str) -> list[dict[str, Any]]:
        """Problems that list the rows of a job that another version computed again."""
        told = c.execute(sql.CHANGES_OF_ROWS, {"of_job": job, "kind": CHANGED}).scalars()
        return [
            {
                "where": f"cases {d['first_case']} to {d['last_case']}",
                "what": f"version {d['now']} computed these rows again, because the rows of {d['before']} were damaged",
                "hint": "they can differ from the earlier rows; the column version names the version of each row",
            }
            for d in map(json.loads, told)
        ]

    # -- outcomes of chunks -------------------------------------------------------------------------------------------------

    def _locked_job(self, c: Connection, server: str, job: str) -> Any:
        """The row of a job, locked for this transaction. LeaseLost when this server does not have the lease of the job."""
        row = c.execute(sql.LOCKED_JOB, {"of_job": job}).mappings().one()
        if row["lease_owner"] != server or row["state"] not in ACTIVE:
            raise LeaseLost(job)
        return row

    def record_outcomes(
        self, server: str, job: str, done: Mapping[int, ChunkReport], lost: Mapping[int, FailedAttempt] | None = None, most: int = 1
    ) -> dict[int, str]:
        """Store the outcomes of chunks of a job, by first case, in one transaction. done: chunks with parts. lost: failed attempts.
        most: number of attempts after which a chunk has failed. Returns the new states of the lost chunks. A repeated report has no
        effect."""
        return self.record_last_outcomes(server, job, done, lost or {}, most, last=False)[0]

    def record_last_outcomes(
        self, server: str, job: str, done: Mapping[int, ChunkReport], lost: Mapping[int, FailedAttempt], most: int,
        last: bool = True,
    ) -> tuple[dict[int, str], str | None]:
        """The results of ``record_outcomes`` and, if ``last``, of ``end_if_over``, in one transaction."""
        with transaction(self.engine, writing=True) as c:
            row, now = self._locked_job(c, server, job), self.now(c)
            found = c.execute(sql.CHUNKS_AT, {"of_job": job, "starts": [*done, *lost]}).mappings()
            there = {int(x["start"]): x for x in found}
            self._record_done(c, row, [(there[start], d) for start, d in done.items() if there[start]["state"] != "done"], now)
            going = [(there[start], gone) for start, gone in lost.items() if there[start]["state"] == "running"]
            states = {start: str(there[start]["state"]) for start in lost} | self._record_lost(c, job, going, most, now)
            return states, self._end_if_over(c, self._locked_job(c, server, job)) if last else None

    def _record_done(self, c: Connection, row: Any, landed: list[tuple[Any, ChunkReport]], now: float) -> None:
        """Store the reports of chunks with parts. landed: (row of the chunk, report)."""
        if not landed:
            return
        self._add_costs(c, row, [d for _, d in landed], now)
        job, stops = row["id"], [chunk["stop"] if d.reached is None else d.reached for chunk, d in landed]
        kept = [
            {"of_job": job, "at": chunk["start"], "until": stop, "told": json.dumps(d.counts), "size": d.bytes, "by": d.version}
            for (chunk, d), stop in zip(landed, stops, strict=True)
            if stop > chunk["start"]
        ]
        if kept:
            c.execute(sql.STORE_DONE, kept)
        ended = []
        for (chunk, d), stop in zip(landed, stops, strict=True):
            self._split_chunk(c, job, chunk, stop)
            result = "done" if stop == chunk["stop"] else f"overran at case {stop}"
            ended.append({"at": chunk["start"], "by": d.worker[:255], "told": result})
        self._end_attempts(c, job, ended, now)
        changed = [
            (CHANGED, {"first_case": chunk["start"], "last_case": stop - 1, "before": chunk["version"], "now": d.version})
            for (chunk, d), stop in zip(landed, stops, strict=True)
            if d.version and chunk["version"] not in ("", d.version)
        ]
        self._events(c, job, changed)

    def _record_lost(self, c: Connection, job: str, gone: list[tuple[Any, FailedAttempt]], most: int, now: float) -> dict[int, str]:
        """Store failed attempts to run chunks. gone: (row of the chunk, failed attempt). Returns the new states by first case."""
        if not gone:
            return {}
        states, values, told, failed = {}, [], [], 0
        for chunk, lost in gone:
            tried = chunk["attempts"] if lost.blame else max(0, chunk["attempts"] - 1)
            state = states[int(chunk["start"])] = "failed" if tried >= most else "waiting"
            due, why = now + lost.delay, lost.error[:2000]
            values.append({"at": chunk["start"], "now": state, "tried": tried, "due": due, "why": why})
            about = {"first_case": chunk["start"], "last_case": chunk["stop"] - 1, "attempt": tried, "error": lost.error[:300]}
            told.append(("chunk_failed" if state == "failed" else "chunk_retried", about))
            failed += chunk["stop"] - chunk["start"] if state == "failed" else 0
        named = {"state": "now", "attempts": "tried", "not_before": "due", "error": "why"}
        new: dict[str, Any] = {column: bindparam(name) for column, name in named.items()}
        c.execute(update(chunks).where(chunks.c.job == job, chunks.c.start == bindparam("at")).values(new), values)
        self._end_attempts(c, job, [{"at": v["at"], "by": "", "told": v["why"]} for v in values], now)
        if failed:
            c.execute(update(jobs).where(jobs.c.id == job).values(lost=jobs.c.lost + failed))
        self._events(c, job, told)
        return states

    def _add_costs(self, c: Connection, row: Any, landed: Sequence[ChunkReport], now: float) -> None:
        """Add the reports of chunks to the sums and to the pace of their job."""
        counts = sum((Counter(d.counts) for d in landed), Counter(json.loads(row["counts"])))
        n, build = sum(sum(d.counts.values()) for d in landed), sum(d.build_seconds for d in landed)
        values: dict[str, Any] = {
            "of_job": row["id"],
            "done": row["done"] + n,
            "bytes": row["bytes"] + sum(d.bytes for d in landed),
            "seconds": row["seconds"] + sum(d.seconds for d in landed),
            "build_seconds": row["build_seconds"] + build,
            "counts": json.dumps(counts),
        }
        since = row["landed"] or row["started"]
        if n and since is not None and now >= since:
            taken = max(0.0, now - since - build) / n
            weight = max(RECENT, n / (row["done"] + n)) if row["pace"] else 1.0
            values |= {"pace": row["pace"] + weight * (taken - row["pace"])}
        if n:
            values["landed"] = now
        c.execute(sql.CHANGE_JOB, values)

    def _split_chunk(self, c: Connection, job: str, chunk: Any, reached: int) -> None:
        """Split the rest of a chunk that took too long. The case that was running becomes one chunk, and the cases after it become
        two chunks."""
        stop = chunk["stop"]
        if reached >= stop:
            return
        middle = reached + 1 + (stop - reached) // 2
        for low, high in ((reached, reached + 1), (reached + 1, min(middle, stop)), (min(middle, stop), stop)):
            values = {"stop": high, "state": "waiting", "attempts": 0, "not_before": 0.0, "version": chunk["version"]}
            values["error"] = OVERRAN if low == reached else ""
            if low == chunk["start"]:
                c.execute(update(chunks).where(chunks.c.job == job, chunks.c.start == low).values(values))
            elif low < high:
                c.execute(insert(chunks).values(values | {"job": job, "start": low}))
        self._event(c, job, "chunk_split", {"first_case": chunk["start"], "last_case": stop - 1, "overran": reached})

    def reopen_chunk(self, job: str, start: int, why: str) -> None:
        """Set a finished chunk with a damaged part back to waiting, and also chunks whose case counts are unknown. An ended job
        then continues. In a job that was cancelled or used up its budget, the cases are lost. A problem of the job then names the
        lost cases."""
        with transaction(self.engine, writing=True) as c:
            row = c.execute(sql.LOCKED_JOB, {"of_job": job}).mappings().one()
            done = and_(chunks.c.job == job, chunks.c.state == "done")
            if c.execute(select(chunks.c.start).where(done, chunks.c.start == start)).first() is None:
                return
            known = row["cases"] if row["asked"] is None else row["asked"]
            goes_on = (row["state"] != "cancelled" and row["planned"] >= known) or row["state"] in ACTIVE
            values = {"state": "waiting" if goes_on else "dropped", "attempts": 0, "not_before": 0.0, "error": why[:2000]}
            c.execute(update(chunks).where(done, or_(chunks.c.start == start, chunks.c.counts == "")).values(values))
            self._recount_job(c, row)
            c.execute(update(jobs).where(jobs.c.id == job).values(ends=""))
            if goes_on and row["state"] not in ACTIVE:
                free = {"state": "running", "problems": "[]", "lease_owner": None, "lease_until": 0.0}
                c.execute(update(jobs).where(jobs.c.id == job).values(free))
            elif not goes_on:
                told = {
                    "where": f"cases from {start}",
                    "what": f"the stored rows are lost: {why}",
                    "hint": "submit these cases again",
                }
                c.execute(update(jobs).where(jobs.c.id == job).values(problems=json.dumps([*json.loads(row["problems"]), told])))
            self._event(c, job, "part_spoiled", {"first_case": start, "why": why[:300], "computed_again": bool(goes_on)})

    def _recount_job(self, c: Connection, row: Any) -> None:
        """Recompute the sums of a job from its finished chunks. The time of chunks that must run again does not count against the
        budget."""
        there = c.execute(select(chunks).where(chunks.c.job == row["id"], chunks.c.state == "done")).all()
        counts: Counter[str] = sum((Counter(json.loads(x.counts)) for x in there), Counter())
        n = sum(x.stop - x.start for x in there)
        values = {"done": n, "bytes": sum(x.bytes for x in there), "seconds": row["seconds"] * n / max(row["done"], 1)}
        c.execute(update(jobs).where(jobs.c.id == row["id"]).values(values | {"counts": json.dumps(counts)}))

    def _end_attempts(self, c: Connection, job: str, ended: list[dict[str, Any]], now: float) -> None:
        """End the last attempt at each chunk. ended: dictionaries with first case (at), worker (by) and result (told)."""
        c.execute(sql.END_ATTEMPT, [{"of_job": job, "now": now, **x} for x in ended])

    def attempts(self, job: str) -> list[dict[str, Any]]:
        """All attempts at chunks of a job, in order."""
        with transaction(self.engine) as c:
            return [dict(x) for x in c.execute(select(attempts).where(attempts.c.job == job).order_by(attempts.c.id)).mappings()]
