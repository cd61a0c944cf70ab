"""Alembic's entry: migrations run on the connection handed over by ``trunnion.service.store.database_connection``."""

from alembic import context

from trunnion.service.store.table_definitions import metadata

context.configure(connection=context.config.attributes["connection"], target_metadata=metadata, render_as_batch=True)
context.run_migrations()
