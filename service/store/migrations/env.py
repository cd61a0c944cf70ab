"""The entry point of Alembic. Migrations run on the connection that ``trunnion.service.store.database_connection`` passes."""

from alembic import context

from trunnion.service.store.table_definitions import metadata

context.configure(connection=context.config.attributes["connection"], target_metadata=metadata, render_as_batch=True)
context.run_migrations()
