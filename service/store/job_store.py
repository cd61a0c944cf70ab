"""The store of jobs, events, keys, the audit log and webhooks. Every method is one transaction. If a method raises ``Unreachable``,
nothing was stored, with one exception. If the connection broke during the commit, all changes may have been stored."""

from __future__ import annotations

import base64
import binascii
import json
import secrets
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from sqlalchemy import Connection, and_, delete, func, insert, or_, select, update
from sqlalchemy.exc import IntegrityError

from trunnion.service.store import frequent_statements as sql
from trunnion.service.store.database_connection import engine_of, transaction, upgrade
from trunnion.service.store.store_records import Chunk, Job, Key, StoredEvent, record_of
from trunnion.service.store.table_definitions import (
    ACTIVE,
    EARLIER,
    ENDED,
    STATES,
    UNKNOWN,
    audit,
    chunks,
    events,
    hooks,
    jobs,
    keys,
)

T = TypeVar("T")
DAY = 86_400.0
CLAIM_SECONDS = 60.0
"""Time for which a server claims a webhook, s. During this time, no other server sends the webhook."""


@dataclass(frozen=True)
class Webhook:
    """A webhook to send. kind: the event. url: the address. attempts: number of attempts, including this one."""

    id: int
    kind: str
    url: str
    attempts: int
    job: Job


class Conflict(RuntimeError):
    """The idempotency key was already used for a different request."""


class BadCursor(ValueError):
    """An invalid cursor."""


class Store:
    """The operations that clients, retention and webhooks need. The derived class ``WorkStore`` adds the operations that run
    jobs."""

    def __init__(self, url: str):
        self.engine = engine_of(url)

    def upgrade(self) -> None:
        upgrade(self.engine)

    def close(self) -> None:
        self.engine.dispose()

    def now(self, c: Connection) -> float:
        """The time by the clock of the database, in seconds since the epoch. All servers share this clock."""
        if self.engine.dialect.name == "postgresql":
            return float(c.exec_driver_sql("SELECT extract(epoch FROM clock_timestamp())").scalar_one())
        return time.time()  # the time functions of SQLite use the clock of this machine, as time.time() does

    def ping(self) -> None:
        """Query the database. Raises Unreachable when the database does not respond."""
        with transaction(self.engine) as c:
            c.execute(select(func.count()).select_from(keys))

    def _all(self, query: Any, kind: type[T], **values: Any) -> list[T]:
        """The records of the rows that a query with these values of its parameters selects."""
        with transaction(self.engine) as c:
            return [record_of(kind, row) for row in c.execute(query, values).mappings()]

    # -- jobs ---------------------------------------------------------------------------------------------------------------

    def submit(
        self, owner: str, digest: str, scene: str, label: str, document: str, cases: int, budget: float, key: str | None = None,
        tags: Sequence[str] = (), notify: str = "", asked: int | None = None, server: str | None = None, lease: float = 0.0,
    ) -> tuple[Job, bool]:  # fmt: skip
        """Store a new job. Returns the job, and whether the job is new. If the idempotency ``key`` was used before with the same
        ``digest``, returns the existing job. Conflict if the key was used with another digest. asked: number of known cases of a
        study, which is 0 for a new study. None for any other job. server: the server that leases the new job for ``lease`` seconds,
        if any."""
        values: dict[str, Any] = {
            "id": secrets.token_hex(12),
            "owner": owner,
            "idempotency_key": key,
            "digest": digest,
            "scene": scene,
            "label": label,
            "document": document,
            "state": "queued",
            "cases": cases,
            "budget": budget,
            "tags": json.dumps(list(tags)),
            "notify": notify,
            "asked": asked,
            "lease_owner": server,
            "lease": lease,
        }
        try:
            with transaction(self.engine, writing=True) as c:
                now = self.now(c)
                c.execute(sql.ADD_JOB, values | {"created": now, "lease_until": now + lease})
                self._event(c, values["id"], "submitted", {"cases": cases})
                self._note(c, owner, "submitted", values["id"], {"cases": cases, "scene": scene})
                return record_of(Job, c.execute(sql.JOB_OF_ID, {"of_job": values["id"]}).mappings().one()), True
        except IntegrityError:
            with transaction(self.engine) as c:
                same = and_(jobs.c.owner == owner, jobs.c.idempotency_key == key)
                earlier = record_of(Job, c.execute(sql.JOBS.where(same)).mappings().one())
            if earlier.digest != digest:
                raise Conflict(f"the idempotency key belongs to job {earlier.id}, whose request differs: use a new key") from None
            return earlier, False

    def job(self, job: str) -> Job | None:
        """The job with this id, or None."""
        return next(iter(self._all(sql.JOB_OF_ID, Job, of_job=job)), None)

    def document(self, job: str) -> dict[str, Any]:
        """The stored request of a job."""
        with transaction(self.engine) as c:
            return json.loads(c.execute(sql.DOCUMENT, {"of_job": job}).scalar_one())

    def page(
        self,
        state: str | None = None,
        scene: str | None = None,
        label: str | None = None,
        tag: str | None = None,
        search: str | None = None,
        cursor: str | None = None,
        limit: int = 50,
    ) -> tuple[list[Job], str | None]:
        """A page of jobs, newest first, and the cursor of the next page (None on the last page). BadCursor for an invalid
        cursor."""
        query = sql.JOBS.order_by(jobs.c.created.desc(), jobs.c.id.desc()).limit(limit + 1)
        for column, wanted in ((jobs.c.state, state), (jobs.c.scene, scene), (jobs.c.label, label)):
            if wanted is not None:
                query = query.where(column == wanted)
        if tag is not None:
            query = query.where(jobs.c.tags.contains(json.dumps(tag), autoescape=True))
        if search is not None:
            words = (jobs.c.label, jobs.c.scene, jobs.c.tags, jobs.c.id)
            query = query.where(or_(*(c.icontains(search, autoescape=True) for c in words)))
        if cursor is not None:
            created, last = _decoded(cursor)
            query = query.where(or_(jobs.c.created < created, and_(jobs.c.created == created, jobs.c.id < last)))
        found = self._all(query, Job)
        more = len(found) > limit
        found = found[:limit]
        return found, _encoded(found[-1]) if more else None

    def cancel(self, job: str) -> Job | None:
        """Request the cancellation of a job. A queued job without a valid lease is ``cancelled`` at once. Returns the job, or None
        for an unknown id."""
        with transaction(self.engine, writing=True) as c:
            now = self.now(c)
            idle = or_(jobs.c.lease_owner.is_(None), jobs.c.lease_until < now)
            free = and_(jobs.c.id == job, jobs.c.state.in_(ACTIVE), idle, jobs.c.state == "queued")
            if c.execute(update(jobs).where(free).values(state="cancelled", finished=now)).rowcount:
                self._event(c, job, "cancelled", {})
                if c.execute(sql.JOB_OF_ID, {"of_job": job}).mappings().one()["notify"]:
                    self._queue_webhook(c, job, "cancelled")
            elif c.execute(
                update(jobs).where(jobs.c.id == job, jobs.c.state.in_(("queued", "running"))).values(state="cancelling")
            ).rowcount:
                self._event(c, job, "cancelling", {})
            row = c.execute(sql.JOB_OF_ID, {"of_job": job}).mappings().first()
            return record_of(Job, row) if row else None

    def _queue_webhook(self, c: Any, job: str, kind: str) -> None:
        """In a transaction, queue a webhook for the end of a job whose request names an address."""
        values = {"job": job, "kind": kind, "attempts": 0, "not_before": 0.0, "state": "waiting"}
        c.execute(insert(hooks).values(values))

    def states(self) -> dict[str, int]:
        """The number of jobs in each state."""
        with transaction(self.engine) as c:
            found = c.execute(select(jobs.c.state, func.count()).group_by(jobs.c.state)).all()
        return dict.fromkeys(STATES, 0) | {str(s): int(n) for s, n in found}

    # -- events -------------------------------------------------------------------------------------------------------------

    def _event(self, c: Any, job: str, kind: str, data: dict[str, Any]) -> None:
        self._events(c, job, [(kind, data)])

    def _events(self, c: Any, job: str, told: Sequence[tuple[str, dict[str, Any]]]) -> None:
        now = self.now(c)
        if told:
            c.execute(sql.ADD_EVENTS, [{"job": job, "time": now, "kind": kind, "data": json.dumps(data)} for kind, data in told])

    def events(self, job: str, after: int = 0, limit: int = 500) -> list[StoredEvent]:
        """The events of a job with ids above ``after``, in order."""
        query = select(events).where(events.c.job == job, events.c.id > after).order_by(events.c.id).limit(limit)
        return self._all(query, StoredEvent)

    # -- keys ---------------------------------------------------------------------------------------------------------------

    def add_key(self, key: Key) -> None:
        """Store a key, with the hash of its secret."""
        with transaction(self.engine, writing=True) as c:
            c.execute(insert(keys).values({n: getattr(key, n) for n in Key.__dataclass_fields__}))

    def key(self, key: str) -> Key | None:
        """The key with this id, even a revoked key; None for an unknown id."""
        return next(iter(self._all(select(keys).where(keys.c.id == key), Key)), None)

    def all_keys(self) -> Sequence[Key]:
        """All keys, oldest first."""
        return self._all(select(keys).order_by(keys.c.created, keys.c.id), Key)

    def revoke(self, key: str) -> bool:
        """Revoke a key. Returns False when no active key has this id."""
        with transaction(self.engine, writing=True) as c:
            found = and_(keys.c.id == key, keys.c.revoked.is_(None))
            return bool(c.execute(update(keys).where(found).values(revoked=self.now(c))).rowcount)

    # -- usage, deletion, tags, audit log -----------------------------------------------------------------------------------

    def usage(self, owner: str) -> dict[str, int]:
        """The present usage of an owner: number of active ``jobs``, ``bytes`` of results, ``cases`` submitted within a day. Cases
        of deleted jobs still count for a day after their submission. ``waiting``: number of active jobs of all owners."""
        with transaction(self.engine) as c:
            since = self.now(c) - DAY
            active, kept, today = c.execute(sql.USAGE, {"of_owner": owner, "since": since}).one()
            gone = c.execute(sql.DELETIONS, {"since": since}).scalars()
            deleted = [d for d in map(json.loads, gone) if d.get("owner") == owner and d.get("created", 0.0) > since]
            waiting = c.execute(sql.ACTIVE_JOBS).scalar_one()
        cases = int(today) + sum(d["cases"] for d in deleted)
        return {"jobs": int(active), "bytes": int(kept), "cases": cases, "waiting": int(waiting)}

    def delete(self, job: str, who: str, **data: Any) -> bool:
        """Delete an ended job with its chunks and events, and add the deletion to the audit log. Returns False if the job has not
        ended or does not exist."""
        with transaction(self.engine, writing=True) as c:
            gone = bool(c.execute(delete(jobs).where(jobs.c.id == job, jobs.c.state.in_(ENDED))).rowcount)
            if gone:
                self._note(c, who, "deleted", job, data)
        return gone

    def deleted(self, job: str) -> bool:
        """Whether a job was deleted."""
        with transaction(self.engine) as c:
            query = select(audit.c.id).where(audit.c.about == job, audit.c.what == "deleted").limit(1)
            return c.execute(query).first() is not None

    def older(self, seconds: float, most: int = 200) -> list[Job]:
        """The first ``most`` jobs that ended more than ``seconds`` ago, oldest first."""
        with transaction(self.engine) as c:
            old = sql.JOBS.where(jobs.c.state.in_(ENDED), jobs.c.finished < self.now(c) - seconds)
            return [record_of(Job, row) for row in c.execute(old.order_by(jobs.c.finished).limit(most)).mappings()]

    def mark(self, job: str, label: str | None, tags: list[str] | None) -> None:
        """Change the label or the tags of a job; None changes nothing."""
        values = ({"label": label} if label is not None else {}) | ({"tags": json.dumps(tags)} if tags is not None else {})
        if values:
            with transaction(self.engine, writing=True) as c:
                c.execute(update(jobs).where(jobs.c.id == job).values(values))

    def note(self, who: str, what: str, about: str, **data: Any) -> None:
        """Add an entry to the audit log."""
        with transaction(self.engine, writing=True) as c:
            self._note(c, who, what, about, data)

    def _note(self, c: Connection, who: str, what: str, about: str, data: dict[str, Any]) -> None:
        told = {"time": self.now(c), "who": who, "what": what, "about": about, "data": json.dumps(data)}
        c.execute(sql.ADD_NOTE, told)

    def audit_records(
        self, after: int = 0, limit: int = 100, who: str | None = None, about: str | None = None
    ) -> list[dict[str, Any]]:
        """The entries of the audit log with ids above ``after``, in order. who, about: only entries with this value."""
        query = select(audit).where(audit.c.id > after).order_by(audit.c.id).limit(limit)
        for column, wanted in ((audit.c.who, who), (audit.c.about, about)):
            if wanted is not None:
                query = query.where(column == wanted)
        with transaction(self.engine) as c:
            return [{**row, "data": json.loads(row["data"])} for row in c.execute(query).mappings()]

    # -- parts of earlier versions -----------------------------------------------------------------------------------------

    def unexamined(self, most: int) -> list[Chunk]:
        """At most ``most`` finished chunks whose parts an earlier version wrote and this version has not examined yet."""
        query = select(chunks).where(chunks.c.version == UNKNOWN, chunks.c.state == "done").order_by(chunks.c.job, chunks.c.start)
        return self._all(query.limit(most), Chunk)

    def adopt(self, chunk: Chunk, counts: Mapping[str, int], size: int) -> None:
        """Store that the part of a chunk was examined. counts: number of cases by outcome, {} if unknown. size: size of the part in
        bytes."""
        found = {"counts": json.dumps(counts), "bytes": size} if counts else {}
        here = and_(chunks.c.job == chunk.job, chunks.c.start == chunk.start)
        with transaction(self.engine, writing=True) as c:
            c.execute(update(chunks).where(here).values(found | {"version": EARLIER}))

    # -- webhooks -----------------------------------------------------------------------------------------------------------

    def next_webhook(self) -> Webhook | None:
        """Claim the next webhook that is due; None if no webhook is due."""
        with transaction(self.engine, writing=True) as c:
            now = self.now(c)
            due = or_(hooks.c.not_before <= now, hooks.c.not_before > now + DAY)  # the clock was set back
            query = select(hooks).where(hooks.c.state == "waiting", due).order_by(hooks.c.not_before, hooks.c.id).limit(1)
            row = c.execute(query.with_for_update()).mappings().first()
            if row is None:
                return None
            again = {"attempts": hooks.c.attempts + 1, "not_before": now + CLAIM_SECONDS}
            c.execute(update(hooks).where(hooks.c.id == row["id"]).values(again))
            job = c.execute(sql.JOB_OF_ID, {"of_job": row["job"]}).mappings().one()
            return Webhook(row["id"], row["kind"], job["notify"], row["attempts"] + 1, record_of(Job, job))

    def record_delivery(self, hook: Webhook, result: str, delay: float | None) -> None:
        """Store the result of an attempt. delay: time until the next attempt, s. None without a next attempt: the webhook was
        delivered (``result`` "told"), or the last attempt failed."""
        with transaction(self.engine, writing=True) as c:
            state = "waiting" if delay is not None else "told" if result == "told" else "given_up"
            values = {"state": state, "not_before": self.now(c) + (delay or 0.0)}
            c.execute(update(hooks).where(hooks.c.id == hook.id).values(values))
            self._event(c, hook.job.id, f"webhook_{state}", {"attempt": hook.attempts, "result": result[:300]})



def _encoded(job: Job) -> str:
    return base64.urlsafe_b64encode(f"{job.created!r} {job.id}".encode()).decode()


def _decoded(cursor: str) -> tuple[float, str]:
    try:
        created, _, last = base64.b64decode(cursor.encode("ascii"), b"-_", validate=True).decode("ascii").partition(" ")
        if len(last) != 24 or not last.isalnum():
            raise ValueError
        return float(created), last
    except (ValueError, binascii.Error) as e:
        raise BadCursor("invalid cursor") from e
