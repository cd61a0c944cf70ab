"""Adds an index by which recent entries of the audit log are found."""

from alembic import op

revision = "0006"
down_revision = "0005"


def upgrade() -> None:
    """Add the index."""
    op.create_index("ix_audit_time", "audit", ["time"])
