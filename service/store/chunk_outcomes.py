"""The part of the store for the outcomes of chunks: done, split after an overrun, or lost. Every write requires the lease of the
job."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, and_, bindparam, func, insert, or_, select, update

from trunnion.service.store.database_connection import transaction
from trunnion.service.store.table_definitions import ACTIVE, attempts, chunks, jobs
from trunnion.service.store.usage_audit_webhooks import HousekeepingStore

RECENT = 0.25
"""Smallest weight of the newest rows in the pace of a job, which is a weighted mean."""

OVERRAN = "it overran"
"""Error text of a waiting chunk whose case took too long. All other cases run before such a chunk."""


class LeaseLost(RuntimeError):
    """Another server has the lease of the job. This server must write nothing more about the job."""


@dataclass(frozen=True)
class Done:
    """The report of a chunk. counts: number of cases by outcome. seconds, build_seconds: time of stepping and of building, s.
    bytes: size of the part. reached: end of the finished cases, None if all are finished; the remaining cases must still run."""

    counts: dict[str, int]
    seconds: float
    build_seconds: float
    bytes: int
    worker: str = ""
    reached: int | None = None


@dataclass(frozen=True)
class Lost:
    """A failed attempt. delay: time until the next attempt, s. blame: whether the attempt counts towards the limit of attempts."""

    error: str
    delay: float
    blame: bool = True


class ChunkOutcomeStore(HousekeepingStore):
    """The part of the store for outcomes of chunks."""

    def _locked_job(self, c: Connection, server: str, job: str) -> Any:
        """The row of a job, locked; LeaseLost when this server does not have the lease of the job."""
        row = c.execute(select(jobs).where(jobs.c.id == job).with_for_update()).mappings().one()
        if row["lease_owner"] != server or row["state"] not in ACTIVE:
            raise LeaseLost(job)
        return row

    def record_outcomes(
        self, server: str, job: str, done: Mapping[int, Done], lost: Mapping[int, Lost] | None = None, most: int = 1
    ) -> dict[int, str]:
        """Store the outcomes of chunks of a job, by first case, in one transaction. done: chunks with parts. lost: failed attempts.
        most: number of attempts after which a chunk has failed. Returns the new states of the lost chunks. A repeated report has no
        effect."""
        lost = lost or {}
        with transaction(self.engine, writing=True) as c:
            row, now = self._locked_job(c, server, job), self.now(c)
            found = c.execute(select(chunks).where(chunks.c.job == job, chunks.c.start.in_([*done, *lost]))).mappings()
            there = {int(x["start"]): x for x in found}
            self._record_done(c, row, [(there[start], d) for start, d in done.items() if there[start]["state"] != "done"], now)
            going = [(there[start], gone) for start, gone in lost.items() if there[start]["state"] == "running"]
            return {start: str(there[start]["state"]) for start in lost} | self._record_lost(c, job, going, most, now)

    def _record_done(self, c: Connection, row: Any, landed: list[tuple[Any, Done]], now: float) -> None:
        """Store the reports of chunks with parts. landed: (row of the chunk, report)."""
        if not landed:
            return
        self._add_costs(c, row, [d for _, d in landed], now)
        stops = [chunk["stop"] if d.reached is None else d.reached for chunk, d in landed]
        kept = [
            {"at": chunk["start"], "until": stop, "told": json.dumps(d.counts), "size": d.bytes}
            for (chunk, d), stop in zip(landed, stops, strict=True)
            if stop > chunk["start"]
        ]
        if kept:
            told: dict[str, Any] = {"stop": bindparam("until"), "counts": bindparam("told"), "bytes": bindparam("size")}
            here = and_(chunks.c.job == row["id"], chunks.c.start == bindparam("at"))
            c.execute(update(chunks).where(here).values(told | {"state": "done", "error": ""}), kept)
        ended = []
        for (chunk, d), stop in zip(landed, stops, strict=True):
            self._split_chunk(c, row["id"], chunk, stop)
            result = "done" if stop == chunk["stop"] else f"overran at case {stop}"
            ended.append({"at": chunk["start"], "by": d.worker[:255], "told": result})
        self._end_attempts(c, row["id"], ended, now)

    def _record_lost(self, c: Connection, job: str, gone: list[tuple[Any, Lost]], most: int, now: float) -> dict[int, str]:
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

    def _add_costs(self, c: Connection, row: Any, landed: Sequence[Done], now: float) -> None:
        """Add the reports of chunks to the sums and to the pace of their job."""
        counts = sum((Counter(d.counts) for d in landed), Counter(json.loads(row["counts"])))
        n, build = sum(sum(d.counts.values()) for d in landed), sum(d.build_seconds for d in landed)
        values: dict[str, Any] = {
            "done": jobs.c.done + n,
            "bytes": jobs.c.bytes + sum(d.bytes for d in landed),
            "seconds": jobs.c.seconds + sum(d.seconds for d in landed),
            "build_seconds": jobs.c.build_seconds + build,
            "counts": json.dumps(counts),
        }
        since = row["landed"] or row["started"]
        if n and since is not None and now >= since:
            taken = max(0.0, now - since - build) / n
            weight = max(RECENT, n / (row["done"] + n)) if row["pace"] else 1.0
            values |= {"pace": row["pace"] + weight * (taken - row["pace"])}
        if n:
            values["landed"] = now
        c.execute(update(jobs).where(jobs.c.id == row["id"]).values(values))

    def _split_chunk(self, c: Connection, job: str, chunk: Any, reached: int) -> None:
        """Split the rest of a chunk that took too long. The case that was running becomes one chunk, and the cases after it become
        two chunks."""
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

    def reopen_chunk(self, job: str, start: int, why: str) -> None:
        """Set a finished chunk with a damaged part back to waiting, and also chunks whose case counts are unknown. An ended job
        then continues. In a job that was cancelled or used up its budget, the cases are lost, which is added to the job's
        problems."""
        with transaction(self.engine, writing=True) as c:
            row = c.execute(select(jobs).where(jobs.c.id == job).with_for_update()).mappings().one()
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
                free = {"state": "running", "finished": None, "problems": "[]", "lease_owner": None, "lease_until": 0.0}
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
        """Recompute the sums of a job from its finished chunks. The time of chunks that must run again no longer counts against the
        budget."""
        query = select(chunks.c.start, chunks.c.stop, chunks.c.counts, chunks.c.bytes)
        there = c.execute(query.where(chunks.c.job == row["id"], chunks.c.state == "done")).all()
        counts: Counter[str] = sum((Counter(json.loads(x.counts)) for x in there), Counter())
        n = sum(x.stop - x.start for x in there)
        seconds = row["seconds"] * n / max(row["done"], 1)
        values = {"done": n, "counts": json.dumps(counts), "bytes": sum(x.bytes for x in there), "seconds": seconds}
        c.execute(update(jobs).where(jobs.c.id == row["id"]).values(values))

    def _end_attempts(self, c: Connection, job: str, ended: list[dict[str, Any]], now: float) -> None:
        """End the last attempt at each chunk. ended: dictionaries with first case (at), worker (by) and result (told)."""
        last = select(func.max(attempts.c.id)).where(attempts.c.job == job, attempts.c.start == bindparam("at")).scalar_subquery()
        values = {"ended": now, "worker": bindparam("by"), "result": bindparam("told")}
        c.execute(update(attempts).where(attempts.c.id == last).values(values), ended)

    def attempts(self, job: str) -> list[dict[str, Any]]:
        """All attempts at chunks of a job, in order."""
        query = select(attempts).where(attempts.c.job == job).order_by(attempts.c.id)
        with transaction(self.engine) as c:
            return [dict(row) for row in c.execute(query).mappings()]
