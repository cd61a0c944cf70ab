"""Database engine, transactions and migrations."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sqlalchemy import Connection, Engine, create_engine, event, inspect, make_url
from sqlalchemy.exc import ArgumentError, DBAPIError, SQLAlchemyError
from sqlalchemy.exc import TimeoutError as PoolTimeout

from trunnion.basics.errors import Problem, SceneError
from trunnion.service.store.table_definitions import metadata

BUSY_SECONDS = 30
CONNECT_SECONDS = 5


class Unreachable(RuntimeError):
    """The database is unavailable (down, locked, or its disk is full). A retry can succeed."""


def engine_of(url: str) -> Engine:
    """The SQLAlchemy engine for ``sqlite:///file`` or ``postgresql://…`` (driver psycopg). SceneError for an invalid address."""
    try:
        parsed = make_url(url)
        if parsed.get_backend_name() == "sqlite":
            return _sqlite(parsed)
        if parsed.drivername == "postgresql":
            parsed = parsed.set(drivername="postgresql+psycopg")
        if parsed.get_backend_name() != "postgresql":
            raise ArgumentError(f"{parsed.get_backend_name()} is not supported")
        waiting = {"connect_timeout": CONNECT_SECONDS}
        return create_engine(parsed, pool_pre_ping=True, pool_size=10, max_overflow=20, pool_timeout=15, connect_args=waiting)
    except (ArgumentError, ModuleNotFoundError) as e:
        raise SceneError(
            [Problem("--database", f"{e}", "sqlite:///path/to/file.db, or postgresql://user:password@host/name")]
        ) from e


def _sqlite(url: Any) -> Engine:
    if url.database in (None, "", ":memory:"):
        raise ArgumentError("a database in memory is not durable")
    Path(url.database).parent.mkdir(parents=True, exist_ok=True)
    engine = create_engine(url, connect_args={"timeout": BUSY_SECONDS, "check_same_thread": False}, pool_size=10, max_overflow=30)

    @event.listens_for(engine, "connect")
    def connected(connection: Any, _: Any) -> None:
        connection.isolation_level = None  # the event handler below begins transactions
        cursor = connection.cursor()
        for pragma in ("journal_mode=WAL", "synchronous=FULL", "foreign_keys=ON"):
            cursor.execute(f"PRAGMA {pragma}")
        cursor.close()

    @event.listens_for(engine, "begin")
    def begun(connection: Connection) -> None:
        immediate = connection.get_execution_options().get("writing", False)
        connection.exec_driver_sql("BEGIN IMMEDIATE" if immediate else "BEGIN")

    return engine


@contextmanager
def transaction(engine: Engine, writing: bool = False) -> Iterator[Connection]:
    """A connection in a transaction. Raises Unreachable when the database is unavailable."""
    try:
        with engine.connect().execution_options(writing=writing) as connection, connection.begin():
            yield connection
    except (DBAPIError, PoolTimeout) as e:
        if isinstance(e, DBAPIError) and _ours(e):
            raise
        raise Unreachable(_short(e)) from e


def _ours(e: DBAPIError) -> bool:
    """Whether the statement caused the error. If not, the database is unavailable."""
    from sqlalchemy.exc import DataError, IntegrityError, ProgrammingError

    return isinstance(e, IntegrityError | DataError | ProgrammingError)


def _short(e: SQLAlchemyError) -> str:
    return str(getattr(e, "orig", None) or e).strip().splitlines()[0][:300]


def upgrade(engine: Engine) -> None:
    """Create the tables in a new database, or migrate the tables of an earlier version. Raises Unreachable when the database is
    unavailable, and SceneError for tables of a newer version."""
    from alembic import command
    from alembic.util.exc import CommandError

    with transaction(engine, writing=True) as connection:
        if engine.dialect.name == "postgresql":
            connection.exec_driver_sql("SELECT pg_advisory_xact_lock(7479)")  # two servers can start at the same time
        config = alembic_config(connection)
        if not inspect(connection).has_table("alembic_version"):
            metadata.create_all(connection, checkfirst=False)
            command.stamp(config, "head")
            return
        try:
            command.upgrade(config, "head")
        except CommandError as e:  # the revision of the tables is unknown to this version
            hint = "use that version, another --data folder, or another --database"
            raise SceneError([Problem("--database", "the tables were made by a newer version of Trunnion", hint)]) from e


def alembic_config(connection: Connection) -> Any:
    from alembic.config import Config

    config = Config()
    config.set_main_option("script_location", str(Path(__file__).with_name("migrations")))
    config.attributes["connection"] = connection
    return config
