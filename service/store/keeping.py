"""Housekeeping: what a key has used, what is old, deleting, tags, and the record of who did what."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, delete, func, insert, select, update

from service.store.database import transaction
from service.store.rows import Job, job_of
from service.store.store import Store
from service.store.tables import ACTIVE, ENDED, audit, jobs

DAY = 86_400.0


@dataclass(frozen=True)
class Usage:
    """What an owner has: jobs that wait or run, bytes of results kept, cases submitted within a day."""

    jobs: int
    bytes: int
    cases: int


@dataclass(frozen=True)
class Deed:
    """Something that was done: when, by whose key, what, about which job or key."""

    id: int
    time: float
    who: str
    what: str
    about: str
    data: dict[str, Any]


class KeepingStore(Store):
    """What a server that runs for months needs."""

    def usage(self, owner: str) -> Usage:
        """What an owner has now. Cases of jobs that were deleted are of their day all the same."""
        with transaction(self.engine) as c:
            own, now = jobs.c.owner == owner, self.now(c)
            active = c.execute(select(func.count()).select_from(jobs).where(own, jobs.c.state.in_(ACTIVE))).scalar_one()
            kept = c.execute(select(func.coalesce(func.sum(jobs.c.bytes), 0)).where(own)).scalar_one()
            today = c.execute(select(func.coalesce(func.sum(jobs.c.cases), 0)).where(own, jobs.c.created > now - DAY)).scalar_one()
            gone = c.execute(select(audit.c.data).where(audit.c.what == "deleted", audit.c.time > now - DAY)).scalars()
            deleted = [d for d in map(json.loads, gone) if d.get("owner") == owner and d.get("created", 0.0) > now - DAY]
        return Usage(int(active), int(kept), int(today) + sum(d["cases"] for d in deleted))

    def delete(self, job: str, who: str, **data: Any) -> bool:
        """Forget a job that has ended, with its chunks and events, and record that; False when it goes on, or there is none."""
        with transaction(self.engine, writing=True) as c:
            gone = bool(c.execute(delete(jobs).where(jobs.c.id == job, jobs.c.state.in_(ENDED))).rowcount)
            if gone:
                self._note(c, who, "deleted", job, data)
        return gone

    def deleted(self, job: str) -> bool:
        """Whether there was a job that was deleted."""
        with transaction(self.engine) as c:
            query = select(audit.c.id).where(audit.c.about == job, audit.c.what == "deleted").limit(1)
            return c.execute(query).first() is not None

    def older(self, seconds: float, most: int = 200) -> list[Job]:
        """Jobs that ended more than so many seconds ago, the oldest first."""
        with transaction(self.engine) as c:
            old = select(jobs).where(jobs.c.state.in_(ENDED), jobs.c.finished < self.now(c) - seconds)
            return [job_of(row) for row in c.execute(old.order_by(jobs.c.finished).limit(most)).mappings()]

    def mark(self, job: str, label: str | None, tags: list[str] | None) -> None:
        """Give a job another label, or other tags."""
        values = ({"label": label} if label is not None else {}) | ({"tags": json.dumps(tags)} if tags is not None else {})
        if values:
            with transaction(self.engine, writing=True) as c:
                c.execute(update(jobs).where(jobs.c.id == job).values(values))

    def note(self, who: str, what: str, about: str, **data: Any) -> None:
        """Record that something was done."""
        with transaction(self.engine, writing=True) as c:
            self._note(c, who, what, about, data)

    def _note(self, c: Connection, who: str, what: str, about: str, data: dict[str, Any]) -> None:
        told = {"time": self.now(c), "who": who, "what": what, "about": about, "data": json.dumps(data)}
        c.execute(insert(audit).values(told))

    def deeds(self, after: int = 0, limit: int = 100, who: str | None = None, about: str | None = None) -> list[Deed]:
        """What was done, from the record with an id above ``after`` on, in order."""
        query = select(audit).where(audit.c.id > after).order_by(audit.c.id).limit(limit)
        for column, wanted in ((audit.c.who, who), (audit.c.about, about)):
            if wanted is not None:
                query = query.where(column == wanted)
        with transaction(self.engine) as c:
            return [Deed(**{**row, "data": json.loads(row["data"])}) for row in c.execute(query).mappings()]
