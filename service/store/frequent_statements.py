"""The statements that the store executes for every job. SQLAlchemy computes the cache key of a statement object once. Therefore a
call with one shared object costs a third of a call with a new object."""

from __future__ import annotations

from typing import Any

from sqlalchemy import BindParameter, bindparam, func, insert, select, update

from trunnion.service.store.table_definitions import ACTIVE, attempts, audit, chunks, events, jobs

JOB: BindParameter[Any] = bindparam("of_job")
SERVER: BindParameter[Any] = bindparam("of_server")
AT: BindParameter[Any] = bindparam("at")
"""Parameters: id of a job, name of a server, first case of a chunk."""
JOBS = select(*(column for column in jobs.c if column is not jobs.c.document))
"""All jobs without their documents, which can be large."""
JOB_OF_ID = JOBS.where(jobs.c.id == JOB)
LOCKED_JOB = JOB_OF_ID.with_for_update()
DOCUMENT = select(jobs.c.document).where(jobs.c.id == JOB)
ADD_JOB, ADD_NOTE = insert(jobs), insert(audit)
SINCE: BindParameter[Any] = bindparam("since")
ACTIVE_JOBS = select(func.count()).select_from(jobs).where(jobs.c.state.in_(ACTIVE))
USAGE = select(
    func.count().filter(jobs.c.state.in_(ACTIVE)),
    func.coalesce(func.sum(jobs.c.bytes), 0),
    func.coalesce(func.sum(jobs.c.cases).filter(jobs.c.created > SINCE), 0),
).where(jobs.c.owner == bindparam("of_owner"))
"""Usage of an owner: number of active jobs, bytes of results, number of cases submitted since a time."""
DELETIONS = select(audit.c.data).where(audit.c.what == "deleted", audit.c.time > SINCE)
CHANGE_JOB = update(jobs).where(jobs.c.id == JOB)
HELD_JOBS = JOBS.where(jobs.c.state.in_(ACTIVE), jobs.c.lease_owner == SERVER).order_by(jobs.c.created, jobs.c.id)
LEASES_OF_OTHERS = select(jobs.c.id, jobs.c.lease_owner, jobs.c.beat, jobs.c.lease).where(
    jobs.c.state.in_(ACTIVE), jobs.c.lease_owner != SERVER
)
RUNNING_CHUNKS = select(chunks).where(chunks.c.job == JOB, chunks.c.state == "running").order_by(chunks.c.start)
CHUNKS_AT = select(chunks).where(chunks.c.job == JOB, chunks.c.start.in_(bindparam("starts", expanding=True)))
CHUNK_ENDS = select(chunks.c.stop, chunks.c.version).where(chunks.c.job == JOB, chunks.c.state == "done").order_by(chunks.c.start)
ADD_CHUNKS, ADD_ATTEMPTS, ADD_EVENTS = insert(chunks), insert(attempts), insert(events)
STORE_DONE = (
    update(chunks)
    .where(chunks.c.job == JOB, chunks.c.start == AT)
    .values(
        stop=bindparam("until"), counts=bindparam("told"), bytes=bindparam("size"), version=bindparam("by"), state="done", error=""
    )
)
"""Stores the report of a chunk with a part."""
END_ATTEMPT = (
    update(attempts)
    .where(
        attempts.c.id
        == select(func.max(attempts.c.id)).where(attempts.c.job == JOB, attempts.c.start == AT).scalar_subquery()
    )
    .values(ended=bindparam("now"), worker=bindparam("by"), result=bindparam("told"))
)
"""Ends the last attempt at a chunk."""
CHANGES_OF_ROWS = select(events.c.data).where(events.c.job == JOB, events.c.kind == bindparam("kind")).order_by(events.c.id)
