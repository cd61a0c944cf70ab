"""The part of the store for the queue of webhooks that report ends of jobs, and for the results of their attempts."""

from __future__ import annotations

from dataclasses import dataclass

from sqlalchemy import or_, select, update

from trunnion.service.store.database_connection import transaction
from trunnion.service.store.job_and_chunk_records import Job, record_of
from trunnion.service.store.table_definitions import hooks, jobs
from trunnion.service.store.usage_tags_audit import DAY, HousekeepingStore

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


class WebhookStore(HousekeepingStore):
    """The part of the store for webhooks."""

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
