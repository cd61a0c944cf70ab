"""The part of the store for usage of keys, deletion of jobs, labels and tags, the audit log, and the queue of webhooks that report
ends of jobs."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, delete, func, insert, or_, select, update

from trunnion.service.store.database_connection import transaction
from trunnion.service.store.job_and_chunk_records import Job, record_of
from trunnion.service.store.jobs_events_keys import Store
from trunnion.service.store.table_definitions import ACTIVE, ENDED, audit, hooks, jobs

DAY = 86_400.0
CLAIM_SECONDS = 60.0
"""Time for which a webhook is claimed, s. During this time, no other server sends it."""


@dataclass(frozen=True)
class Webhook:
    """A webhook to send. kind: the event. url: the address. attempts: number of attempts, including this one."""

    id: int
    kind: str
    url: str
    attempts: int
    job: Job


class HousekeepingStore(Store):
    """The part of the store for usage, deletion, tags, the audit log and webhooks."""

    def usage(self, owner: str) -> dict[str, int]:
        """The present usage of an owner: number of active ``jobs``, ``bytes`` of results, ``cases`` submitted within a day. Cases
        of deleted jobs still count for a day after their submission."""
        with transaction(self.engine) as c:
            own, now = jobs.c.owner == owner, self.now(c)
            active = c.execute(select(func.count()).select_from(jobs).where(own, jobs.c.state.in_(ACTIVE))).scalar_one()
            kept = c.execute(select(func.coalesce(func.sum(jobs.c.bytes), 0)).where(own)).scalar_one()
            today = c.execute(select(func.coalesce(func.sum(jobs.c.cases), 0)).where(own, jobs.c.created > now - DAY)).scalar_one()
            gone = c.execute(select(audit.c.data).where(audit.c.what == "deleted", audit.c.time > now - DAY)).scalars()
            deleted = [d for d in map(json.loads, gone) if d.get("owner") == owner and d.get("created", 0.0) > now - DAY]
        return {"jobs": int(active), "bytes": int(kept), "cases": int(today) + sum(d["cases"] for d in deleted)}

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
            old = select(jobs).where(jobs.c.state.in_(ENDED), jobs.c.finished < self.now(c) - seconds)
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
        c.execute(insert(audit).values(told))

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
            job = c.execute(select(jobs).where(jobs.c.id == row["job"])).mappings().one()
            return Webhook(row["id"], row["kind"], job["notify"], row["attempts"] + 1, record_of(Job, job))

    def record_delivery(self, hook: Webhook, result: str, delay: float | None) -> None:
        """Store the result of an attempt. delay: time until the next attempt, s; None if the webhook was delivered (``result``
        "told") or is given up."""
        with transaction(self.engine, writing=True) as c:
            state = "waiting" if delay is not None else "told" if result == "told" else "given_up"
            values = {"state": state, "not_before": self.now(c) + (delay or 0.0)}
            c.execute(update(hooks).where(hooks.c.id == hook.id).values(values))
            self._event(c, hook.job.id, f"webhook_{state}", {"attempt": hook.attempts, "result": result[:300]})
