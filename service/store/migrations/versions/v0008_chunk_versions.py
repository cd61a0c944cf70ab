"""Adds a column for the version that computed the rows of a chunk. For existing chunks, the version is unknown until the server has
examined their parts (``parts_of_earlier_versions.py``)."""

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"


def upgrade() -> None:
    """Add the column."""
    with op.batch_alter_table("chunks", schema=None) as chunks:
        chunks.add_column(sa.Column("version", sa.String(length=64), nullable=False, server_default=""))
    op.execute("UPDATE chunks SET version = 'unknown' WHERE state = 'done'")
