"""The tables of version 0.1.0. Until that version is released, this revision creates the tables as the code defines them. A change
after the release is a revision of its own, and this one then lists the released columns."""

from alembic import op

from trunnion.service.store.table_definitions import metadata

revision = "0007"
down_revision = None


def upgrade() -> None:
    """Create the tables."""
    metadata.create_all(op.get_bind())
