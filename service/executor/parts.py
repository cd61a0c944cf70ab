"""Parquet parts of jobs, in a folder or at any fsspec URL. A part is there whole or not at all; a part that is there is final."""

from __future__ import annotations

import io
import os
import secrets
from typing import TYPE_CHECKING, Any

import fsspec
from fsspec.implementations.local import LocalFileSystem

from engine.basics.files import replacing

if TYPE_CHECKING:
    import pyarrow


class Parts:
    """The parts of all jobs under one URL. OSError (or what the file system raises) when it cannot be written."""

    def __init__(self, url: str):
        self.url = url
        self.fs, self.root = fsspec.core.url_to_fs(url)
        self.root = self.root.rstrip("/")

    def part(self, job: str, start: int, stop: int) -> str:
        """Path of the part that holds the cases start … stop − 1."""
        return f"{self.root}/{job}/part-{start:09d}-{stop:09d}.parquet"

    def write(self, path: str, data: bytes) -> None:
        """Write bytes under a name, whole or not at all."""
        self.fs.makedirs(path.rpartition("/")[0], exist_ok=True)
        if not isinstance(self.fs, LocalFileSystem):
            self.fs.pipe_file(path, data)  # object stores write whole objects only
            return
        with replacing(path, ".tmp") as work, work.open("wb") as f:
            f.write(data)
            f.flush()
            os.fsync(f.fileno())

    def write_table(self, path: str, table: pyarrow.Table) -> int:
        """Write a table as a Parquet part and return its size in bytes."""
        import pyarrow.parquet as pq

        sink = io.BytesIO()
        pq.write_table(table, sink, compression="zstd")
        self.write(path, sink.getvalue())
        return len(sink.getvalue())

    def read_table(self, path: str, columns: list[str] | None = None) -> pyarrow.Table:
        """Read a part as a table."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        return pq.read_table(pa.BufferReader(self.fs.cat_file(path)), columns=columns)

    def counted(self, path: str) -> tuple[dict[str, int], int] | None:
        """(cases by outcome, size in bytes) of a part; None when it is not there."""
        try:
            data = self.fs.cat_file(path)
        except FileNotFoundError:
            return None
        return outcomes(self.read_table(path, ["outcome"])), len(data)

    def exists(self, path: str) -> bool:
        """Whether a file is there (asked afresh)."""
        self.fs.invalidate_cache()
        return bool(self.fs.exists(path))

    def read(self, path: str) -> bytes:
        """A file's bytes."""
        data: Any = self.fs.cat_file(path)
        return bytes(data)

    def check(self) -> None:
        """Raise when nothing can be written here."""
        path = f"{self.root}/.check-{secrets.token_hex(6)}"
        self.write(path, b"ok")
        self.fs.rm_file(path)

    def marker(self, job: str) -> str:
        """Path of the file that tells workers to stop working on a job."""
        return f"{self.root}/{job}/stopped"

    def job_file(self, job: str) -> str:
        """Path of the file from which workers read the job."""
        return f"{self.root}/{job}/job.json"


def outcomes(table: pyarrow.Table) -> dict[str, int]:
    """Number of cases of a table by outcome."""
    import pyarrow.compute as pc

    return {c["values"]: c["counts"] for c in pc.value_counts(table["outcome"]).to_pylist()}
