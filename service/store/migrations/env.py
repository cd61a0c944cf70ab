"""The entry point of Alembic. The migrations use the connection that ``trunnion.service.store.database_connection`` opens."""

from alembic import context

from trunnion.service.store.table_definitions import metadata

context.configure(connection=context.config.attributes["connection"], target_metadata=metadata, render_as_batch=True)
context.run_migrations()
