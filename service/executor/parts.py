"""Parquet parts of jobs, in a folder or at any fsspec URL. A part is there whole or not at all; a part that is there is final."""

from __future__ import annotations

import os
import secrets
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import fsspec
from fsspec.implementations.local import LocalFileSystem

from engine.basics.files import replacing
from service.executor.sealed import Piece, Spoiled, opened, sealed

if TYPE_CHECKING:
    import pyarrow


class Parts:
    """The parts of all jobs under one URL. OSError (or what the file system raises) when it cannot be written."""

    def __init__(self, url: str):
        self.url = url
        self.fs, self.root = fsspec.core.url_to_fs(url)
        self.root = self.root.rstrip("/")
        self.local = isinstance(self.fs, LocalFileSystem)

    def part(self, piece: Piece) -> str:
        """Path of the part that holds a piece."""
        return f"{self.root}/{piece.job}/part-{piece.start:09d}-{piece.stop:09d}.parquet"

    def write(self, path: str, data: bytes) -> None:
        """Write bytes under a name, whole or not at all."""
        self.fs.makedirs(path.rpartition("/")[0], exist_ok=True)
        if not self.local:
            self.fs.pipe_file(path, data)  # object stores write whole objects only
            return
        with replacing(path, ".tmp") as work, work.open("wb") as f:
            f.write(data)
            f.flush()
            os.fsync(f.fileno())

    def write_part(self, piece: Piece, table: pyarrow.Table) -> int:
        """Write a table as the part of a piece and return its size in bytes."""
        return self.write_table(self.part(piece), piece, table)

    def write_table(self, path: str, piece: Piece, table: pyarrow.Table) -> int:
        """Write a table as what belongs to a piece, and return its size in bytes."""
        data = sealed(table, piece)
        self.write(path, data)
        return len(data)

    def tally(self, piece: Piece) -> str:
        """Path of the tally of a piece's cases."""
        return f"{self.root}/{piece.job}/tally-{piece.start:09d}-{piece.stop:09d}.parquet"

    def all_tally(self, job: str) -> str:
        """Path of the tally of all cases of a job."""
        return f"{self.root}/{job}/tally.parquet"

    def rows_part(self, piece: Piece) -> str:
        """Path of the part that holds the rows kept of a piece's cases."""
        return f"{self.root}/{piece.job}/rows-{piece.start:09d}-{piece.stop:09d}.parquet"

    def write_rows(self, piece: Piece, table: pyarrow.Table) -> int:
        """Write the rows kept of a piece's cases, and return their size in bytes. The piece's own part is written after them: where
        that is, these are."""
        return self.write_table(self.rows_part(piece), piece.of_rows, table)

    def read_rows(self, piece: Piece, columns: list[str] | None = None) -> pyarrow.Table:
        """The rows kept of a piece's cases; Spoiled when they are not what was written. Then the piece's part is taken away, so
        that its cases are computed again."""
        try:
            return opened(self.read(self.rows_part(piece)), piece.of_rows, columns)
        except (Spoiled, FileNotFoundError) as e:
            with suppress(FileNotFoundError):
                self.fs.rm_file(self.part(piece))
            raise Spoiled(f"its rows: {e}" if isinstance(e, Spoiled) else "its rows are not there") from None

    def read_part(self, piece: Piece, columns: list[str] | None = None) -> tuple[pyarrow.Table, int]:
        """(the table of a piece, size of its part in bytes). Spoiled when it is not there, cannot be read, or is not what was
        written for this piece."""
        try:
            data = self.read(self.part(piece))
        except FileNotFoundError:
            raise Spoiled("it is not there") from None
        except OSError as e:
            if not self.local:
                raise  # more likely it is out of reach for now
            raise Spoiled(f"it cannot be read: {e.strerror or e}") from e
        return opened(data, piece, columns), len(data)

    def counted(self, piece: Piece) -> tuple[dict[str, int], int] | None:
        """(cases by outcome, size in bytes) of a piece's part; None when there is none that fits."""
        try:
            table, size = self.read_part(piece, ["outcome"])
        except Spoiled:
            return None
        beside = (self.rows_part(piece), self.tally(piece))
        return outcomes(table), size + sum(int(self.fs.size(path)) for path in beside if self.exists(path))

    def exists(self, path: str) -> bool:
        """Whether a file is there (asked afresh)."""
        self.fs.invalidate_cache()
        return bool(self.fs.exists(path))

    def names(self, job: str) -> set[str]:
        """Names of all files that a job has kept (asked afresh)."""
        self.fs.invalidate_cache()
        try:
            return {str(x).rpartition("/")[2] for x in self.fs.ls(f"{self.root}/{job}", detail=False)}
        except FileNotFoundError:
            return set()

    def read(self, path: str) -> bytes:
        """A file's bytes."""
        data: Any = self.fs.cat_file(path)
        return bytes(data)

    def read_many(self, paths: list[str]) -> list[bytes | None]:
        """The bytes of files, at the same time where the store can do that; None of those that cannot be read."""
        if len(paths) == 1:
            try:
                return [self.read(paths[0])]
            except OSError:
                return [None]
        found: Any = self.fs.cat(paths, on_error="return")
        return [bytes(data) if isinstance(data := found.get(path), bytes) else None for path in paths]

    def folders(self) -> list[str]:
        """What lies where parts are kept."""
        try:
            return [str(x).rstrip("/") for x in self.fs.ls(self.root, detail=False)]
        except FileNotFoundError:
            return []

    def remove(self, job: str) -> None:
        """Remove all that a job has kept."""
        with suppress(FileNotFoundError):
            self.fs.rm(f"{self.root}/{job}", recursive=True)

    def check(self) -> None:
        """Raise when nothing can be written here."""
        path = f"{self.root}/.check-{secrets.token_hex(6)}"
        self.write(path, b"ok")
        self.fs.rm_file(path)

    def marker(self, job: str) -> str:
        """Path of the file that tells workers to stop working on a job."""
        return f"{self.root}/{job}/stopped"

    def stage_file(self, job: str) -> str:
        """Path of the file in which a worker tells what it is at."""
        return f"{self.root}/{job}/stage"

    def job_file(self, job: str) -> str:
        """Path of the file from which workers read the job."""
        return f"{self.root}/{job}/job.json"


def outcomes(table: pyarrow.Table) -> dict[str, int]:
    """Number of cases of a table by outcome."""
    import pyarrow.compute as pc

    return {c["values"]: c["counts"] for c in pc.value_counts(table["outcome"]).to_pylist()}
