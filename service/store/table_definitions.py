"""The database tables. Times are seconds since the epoch; documents are JSON text.

States of a job: queued → running → done | failed | cancelled, with cancelling before cancelled. A job is ``failed`` when chunks
failed in all attempts, or when its budget is used up. The stored results of a failed job are valid. States of a chunk: running →
done, or running → waiting → running … (up to the allowed number of attempts) → failed. A chunk that took too long is cut at its
first unfinished case and is done. The remaining cases wait as separate chunks. A server works on a job while it has the job's
lease.

Columns of a job. asked: number of known cases of a study, null for other jobs. pace: recent wall time of a case with all workers,
s. landed: time at which the last rows arrived. beat: number of renewals of the lease. lease: duration of the lease, s. ends: digest
of the chunk ends of a finished job, "" if unknown.

Columns of a chunk. counts: number of cases by outcome. bytes: size of the part. version: version that computed the rows."""

from __future__ import annotations

from sqlalchemy import BigInteger, Column, Float, ForeignKey, Index, Integer, MetaData, String, Table, Text, UniqueConstraint

metadata = MetaData(
    naming_convention={
        "ix": "ix_%(column_0_label)s",
        "uq": "uq_%(table_name)s_%(column_0_name)s",
        "fk": "fk_%(table_name)s_%(column_0_name)s",
    }
)
COUNTER = BigInteger().with_variant(Integer, "sqlite")
UNKNOWN, EARLIER = "unknown", "an earlier version"
"""Values of the column ``version`` of a chunk that an earlier version of Trunnion computed: UNKNOWN until its part is examined,
then EARLIER."""
ACTIVE = ("queued", "running", "cancelling")
ENDED = ("done", "failed", "cancelled")
STATES = (*ACTIVE, *ENDED)

jobs = Table(
    "jobs",
    metadata,
    Column("id", String(32), primary_key=True),
    Column("created", Float, nullable=False),
    Column("started", Float),
    Column("finished", Float),
    Column("owner", String(64), nullable=False),
    Column("idempotency_key", String(255)),
    Column("digest", String(64), nullable=False),
    Column("scene", String(255), nullable=False),
    Column("label", String(255), nullable=False),
    Column("document", Text, nullable=False),
    Column("state", String(16), nullable=False),
    Column("cases", BigInteger, nullable=False),
    Column("asked", BigInteger),
    Column("planned", BigInteger, nullable=False, default=0),
    Column("done", BigInteger, nullable=False, default=0),
    Column("lost", BigInteger, nullable=False, default=0),
    Column("counts", Text, nullable=False, default="{}"),
    Column("seconds", Float, nullable=False, default=0.0),
    Column("build_seconds", Float, nullable=False, default=0.0),
    Column("bytes", BigInteger, nullable=False, default=0),
    Column("budget", Float, nullable=False),
    Column("problems", Text, nullable=False, default="[]"),
    Column("lease_owner", String(64)),
    Column("lease_until", Float, nullable=False, default=0.0),
    Column("pace", Float, nullable=False, default=0.0, server_default="0"),
    Column("landed", Float),
    Column("beat", BigInteger, nullable=False, default=0, server_default="0"),
    Column("lease", Float, nullable=False, default=0.0, server_default="0"),
    Column("tags", Text, nullable=False, default="[]", server_default="[]"),
    Column("notify", Text, nullable=False, default="", server_default=""),
    Column("ends", String(64), nullable=False, default="", server_default=""),
    UniqueConstraint("owner", "idempotency_key"),
    Index("ix_jobs_owner_created", "owner", "created"),
    Index("ix_jobs_created_id", "created", "id"),
    Index("ix_jobs_state", "state"),
)

chunks = Table(
    "chunks",
    metadata,
    Column("job", String(32), ForeignKey("jobs.id", ondelete="CASCADE"), primary_key=True),
    Column("start", BigInteger, primary_key=True, autoincrement=False),
    Column("stop", BigInteger, nullable=False),
    Column("state", String(16), nullable=False),
    Column("attempts", Integer, nullable=False, default=0),
    Column("not_before", Float, nullable=False, default=0.0),
    Column("error", Text, nullable=False, default=""),
    Column("counts", Text, nullable=False, default="", server_default=""),
    Column("bytes", BigInteger, nullable=False, default=0, server_default="0"),
    Column("version", String(64), nullable=False, default="", server_default=""),
    Index("ix_chunks_job_state", "job", "state"),
)

attempts = Table(
    "attempts",
    metadata,
    Column("id", COUNTER, primary_key=True, autoincrement=True),
    Column("job", String(32), ForeignKey("jobs.id", ondelete="CASCADE"), nullable=False),
    Column("start", BigInteger, nullable=False),
    Column("begun", Float, nullable=False),
    Column("ended", Float),
    Column("worker", String(255), nullable=False, default=""),
    Column("result", Text, nullable=False, default=""),
    Index("ix_attempts_job_start", "job", "start"),
)

events = Table(
    "events",
    metadata,
    Column("id", COUNTER, primary_key=True, autoincrement=True),
    Column("job", String(32), ForeignKey("jobs.id", ondelete="CASCADE"), nullable=False),
    Column("time", Float, nullable=False),
    Column("kind", String(32), nullable=False),
    Column("data", Text, nullable=False, default="{}"),
    Index("ix_events_job_id", "job", "id"),
)

keys = Table(
    "keys",
    metadata,
    Column("id", String(16), primary_key=True),
    Column("name", String(255), nullable=False),
    Column("role", String(16), nullable=False),
    Column("hash", String(64), nullable=False),
    Column("created", Float, nullable=False),
    Column("revoked", Float),
)

audit = Table(
    "audit",
    metadata,
    Column("id", COUNTER, primary_key=True, autoincrement=True),
    Column("time", Float, nullable=False),
    Column("who", String(64), nullable=False),
    Column("what", String(32), nullable=False),
    Column("about", String(64), nullable=False),
    Column("data", Text, nullable=False, default="{}"),
    Index("ix_audit_time", "time"),
)

hooks = Table(
    "hooks",
    metadata,
    Column("id", COUNTER, primary_key=True, autoincrement=True),
    Column("job", String(32), ForeignKey("jobs.id", ondelete="CASCADE"), nullable=False),
    Column("kind", String(32), nullable=False),
    Column("attempts", Integer, nullable=False, default=0),
    Column("not_before", Float, nullable=False, default=0.0),
    Column("state", String(16), nullable=False),
    Index("ix_hooks_state", "state"),
)
