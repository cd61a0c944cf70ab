"""Adds a column for the digest of the chunk ends of a finished job. For older jobs, the store computes the digest on request."""

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"


def upgrade() -> None:
    """Add the column."""
    with op.batch_alter_table("jobs", schema=None) as jobs:
        jobs.add_column(sa.Column("ends", sa.String(length=64), nullable=False, server_default=""))
