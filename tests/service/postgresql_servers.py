"""PostgreSQL servers for tests. They come from the package pgserver, or from programs that a system has installed."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class DatabaseMissing(RuntimeError):
    """No PostgreSQL server can be started here."""


@contextmanager
def packaged(folder: Path) -> Iterator[str]:
    """A server from the package pgserver; its URL."""
    import pgserver

    try:
        server = pgserver.get_server(folder)
    except Exception as e:
        raise DatabaseMissing(f"pgserver cannot start one: {e}") from e
    try:
        yield server.get_uri()
    finally:
        server.cleanup()


@contextmanager
def installed(folder: Path) -> Iterator[str]:
    """A server from initdb and pg_ctl of the system, and its URL. The user postgres runs it if this process runs as root."""
    places = [*sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True)]
    found = shutil.which("initdb", path=os.pathsep.join([os.environ.get("PATH", ""), *map(str, places)]))
    if found is None:
        raise DatabaseMissing("neither the package pgserver nor initdb is installed")
    root = hasattr(os, "geteuid") and os.geteuid() == 0
    prefix = ["runuser", "-u", "postgres", "--"] if root else []

    def run(*words: str) -> None:
        done = subprocess.run([*prefix, *words], capture_output=True, text=True, check=False, cwd=folder)
        if done.returncode:
            raise DatabaseMissing(f"{words[0]}: {done.stderr.strip()[:300]}")

    if root:
        shutil.chown(folder, "postgres")
    data, control = folder / "data", str(Path(found).with_name("pg_ctl"))
    run(found, "-D", str(data), "-U", "postgres", "-A", "trust", "--no-sync")
    run(control, "-D", str(data), "-w", "-l", str(folder / "log"), "-o", f"-k {folder} -c listen_addresses=''", "start")
    try:
        yield f"postgresql://postgres@/postgres?host={folder}"
    finally:
        run(control, "-D", str(data), "-m", "immediate", "stop")
