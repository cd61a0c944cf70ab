"""Databases, servers and browsers for the tests of the service. A test whose tool is missing is skipped with a reason, or fails if
TRUNNION_REQUIRE names the tool."""

from __future__ import annotations

import importlib.util
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.service.http_servers import InProcess, Served
from tests.service.postgresql_servers import DatabaseMissing, installed, packaged
from trunnion.service.basics.server_settings import Limits, Settings


def missing(tool: str, why: str) -> None:
    """Skip the test, or fail if the tool is required."""
    if tool in os.environ.get("TRUNNION_REQUIRE", ""):
        pytest.fail(f"{tool} is required (TRUNNION_REQUIRE): {why}")
    pytest.skip(f"{tool}: {why}")


@pytest.fixture(scope="session")
def postgres() -> Iterator[str]:
    """URL of a PostgreSQL server (package pgserver). The server runs until the tests end."""
    folder = Path(tempfile.mkdtemp(prefix="pg-"))  # the path is short, because the length of a socket's name is limited
    try:
        with installed(folder) if importlib.util.find_spec("pgserver") is None else packaged(folder) as url:
            yield url
    except DatabaseMissing as e:
        missing("postgresql", str(e))
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture(params=["sqlite", "postgresql"])
def database_url(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """URL of an empty database of each kind."""
    if request.param == "sqlite":
        yield f"sqlite:///{tmp_path / 'store.db'}"
        return
    from sqlalchemy import create_engine, make_url

    url = make_url(request.getfixturevalue("postgres")).set(drivername="postgresql+psycopg")
    name = f"t{os.getpid()}_{abs(hash(request.node.nodeid)) % 10**9}"
    admin = create_engine(url, isolation_level="AUTOCOMMIT")
    with admin.connect() as c:
        c.exec_driver_sql(f"CREATE DATABASE {name}")
    yield url.set(database=name).render_as_string(hide_password=False)
    with admin.connect() as c:
        c.exec_driver_sql(f"DROP DATABASE {name} WITH (FORCE)")
    admin.dispose()


@pytest.fixture(scope="package")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[InProcess]:
    """A server in this process (HTTP without sockets), with two workers. All tests of the service share this server."""
    settings = Settings(tmp_path_factory.mktemp("served"), workers=2, limits=Limits(cases=5000, body=200_000), retry_delay=0.05)
    with InProcess(settings) as s:
        yield s


@pytest.fixture(scope="package")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """``trunnion serve`` with one worker. All tests that need no other server share this server."""
    with Served(tmp_path_factory.mktemp("own") / "data", "--workers", "1") as s:
        yield s


@pytest.fixture(scope="package")
def bounded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """``trunnion serve`` with one worker and low limits, so that random requests finish soon."""
    limits = [w for limit in ("cases=200", "duration=1", "rows=2000", "body=100000") for w in ("--limit", limit)]
    with Served(tmp_path_factory.mktemp("bounded") / "data", "--workers", "1", *limits) as s:
        yield s
