"""An index that finds recent entries of the audit log."""

from alembic import op

revision = "0006"
down_revision = "0005"


def upgrade() -> None:
    """Add the index."""
    op.create_index("ix_audit_time", "audit", ["time"])


def downgrade() -> None:
    """Drop it."""
    op.drop_index("ix_audit_time", "audit")
