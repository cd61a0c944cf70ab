"""Alembic's entry: migrations run on the connection handed over by ``service.store.database``."""

from alembic import context

from service.store.tables import metadata

context.configure(connection=context.config.attributes["connection"], target_metadata=metadata, render_as_batch=True)
context.run_migrations()
