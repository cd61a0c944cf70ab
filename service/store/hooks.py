"""Ends of jobs that are to be told to others: which are due, and what became of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sqlalchemy import insert, or_, select, update

from service.store.database import transaction
from service.store.keeping import KeepingStore
from service.store.rows import Job, job_of
from service.store.tables import hooks, jobs

CLAIM_SECONDS = 60.0
"""For so long nobody else tells what one server is about to tell."""


@dataclass(frozen=True)
class Hook:
    """Something to tell: what happened to which job, where it is told, and how often that was tried."""

    id: int
    kind: str
    url: str
    attempts: int
    job: Job


class HookStore(KeepingStore):
    """The part of the store that is about telling others."""

    def _to_tell(self, c: Any, job: str, kind: str) -> None:
        """Within a transaction: the end of a job is to be told, if its request said where."""
        if c.execute(select(jobs.c.notify).where(jobs.c.id == job)).scalar_one():
            values = {"job": job, "kind": kind, "attempts": 0, "not_before": 0.0, "state": "waiting"}
            c.execute(insert(hooks).values(values))

    def due_hook(self) -> Hook | None:
        """The next thing to tell, which nobody else is given for a minute; None when there is none now."""
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
            return Hook(row["id"], row["kind"], job["notify"], row["attempts"] + 1, job_of(job))

    def hook_told(self, hook: Hook, result: str, delay: float | None) -> None:
        """Record what became of it: told (``delay`` None and ``result`` "told"), to be tried again after ``delay`` s, or given
        up."""
        with transaction(self.engine, writing=True) as c:
            state = "waiting" if delay is not None else "told" if result == "told" else "given_up"
            values = {"state": state, "not_before": self.now(c) + (delay or 0.0)}
            c.execute(update(hooks).where(hooks.c.id == hook.id).values(values))
            self._event(c, hook.job.id, f"webhook_{state}", {"attempt": hook.attempts, "result": result[:300]})


DAY = 86_400.0
