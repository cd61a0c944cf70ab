"""Adds columns for the pace of a job, the renewals of its lease, and the contents of its chunks."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"


def upgrade() -> None:
    """Add the columns. The counts of existing chunks are unknown and stay empty."""
    with op.batch_alter_table("jobs", schema=None) as jobs:
        jobs.add_column(sa.Column("pace", sa.Float(), nullable=False, server_default="0"))
        jobs.add_column(sa.Column("landed", sa.Float(), nullable=True))
        jobs.add_column(sa.Column("beat", sa.BigInteger(), nullable=False, server_default="0"))
        jobs.add_column(sa.Column("lease", sa.Float(), nullable=False, server_default="0"))
    with op.batch_alter_table("chunks", schema=None) as chunks:
        chunks.add_column(sa.Column("counts", sa.Text(), nullable=False, server_default=""))
        chunks.add_column(sa.Column("bytes", sa.BigInteger(), nullable=False, server_default="0"))
