"""Parquet parts of jobs, in a folder or at an fsspec URL. A part is written atomically and never changes."""

from __future__ import annotations

import os
import secrets
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import fsspec
from fsspec.implementations.local import LocalFileSystem

from trunnion.basics.arrow_columns import count_by
from trunnion.basics.atomic_files import replacing
from trunnion.service.executor.part_file_format import CaseRange, CorruptPart, part_bytes, read_part_bytes
from trunnion.service.executor.part_versions import version_of

if TYPE_CHECKING:
    import pyarrow


class StorageError(OSError):
    """The storage of the results failed. The text is that of the storage's own error."""


class Storage:
    """A file system of fsspec that is not local. Packages of storages raise errors of many types. Each of these errors, except
    FileNotFoundError, becomes a StorageError."""

    def __init__(self, fs: fsspec.AbstractFileSystem):
        self.fs = fs

    def __getattr__(self, name: str) -> Callable[..., Any]:
        function = getattr(self.fs, name)

        def call(*args: Any, **options: Any) -> Any:
            try:
                return function(*args, **options)
            except FileNotFoundError:
                raise
            except OSError as e:
                raise StorageError(*e.args) from e
            except Exception as e:  # the type depends on the package of the storage
                raise StorageError(f"{type(e).__name__}: {e}") from e

        return call


class Parts:
    """The parts of all jobs under one URL. Methods raise OSError when reading or writing fails; StorageError if the file system is
    not local."""

    def __init__(self, url: str):
        self.url = url
        fs, root = fsspec.core.url_to_fs(url)
        self.root, self.local = root.rstrip("/"), isinstance(fs, LocalFileSystem)
        self.fs: Any = fs if self.local else Storage(fs)

    def part(self, case_range: CaseRange) -> str:
        """Path of the part of a range of cases."""
        return f"{self.root}/{case_range.job}/part-{case_range.start:09d}-{case_range.stop:09d}.parquet"

    def write(self, path: str, data: bytes, lasting: bool = True) -> None:
        """Write bytes to a path, atomically. lasting: whether the file must survive a crash of the machine."""
        self.fs.makedirs(path.rpartition("/")[0], exist_ok=True)
        if not self.local:
            self.fs.pipe_file(path, data)  # object stores write objects atomically
            return
        with replacing(path, ".tmp") as work, work.open("wb") as f:
            f.write(data)
            if lasting:
                f.flush()
                os.fsync(f.fileno())

    def write_part(self, case_range: CaseRange, table: pyarrow.Table) -> int:
        """Write the part of a range of cases. Returns the size of the part in bytes."""
        return self.write_table(self.part(case_range), case_range, table)

    def write_table(self, path: str, case_range: CaseRange, table: pyarrow.Table) -> int:
        """Write a table of a range of cases to a path. Returns the size of the file in bytes."""
        data = part_bytes(table, case_range)
        self.write(path, data)
        return len(data)

    def rows_part(self, case_range: CaseRange) -> str:
        """Path of the trajectory rows of a range of cases."""
        return f"{self.root}/{case_range.job}/rows-{case_range.start:09d}-{case_range.stop:09d}.parquet"

    def write_rows(self, case_range: CaseRange, table: pyarrow.Table) -> int:
        """Write the trajectory rows of a range of cases. Returns the size of the file in bytes. Rows are written before the part,
        so that the rows exist if the part exists."""
        return self.write_table(self.rows_part(case_range), case_range.of_rows, table)

    def read_rows(self, case_range: CaseRange, columns: list[str] | None = None) -> pyarrow.Table:
        """The trajectory rows of a range of cases. If the rows are missing or damaged, the function deletes the part, so that the
        cases are recomputed, and raises CorruptPart."""
        try:
            return read_part_bytes(self.read(self.rows_part(case_range)), case_range.of_rows, columns)
        except (CorruptPart, FileNotFoundError) as e:
            with suppress(FileNotFoundError):
                self.fs.rm_file(self.part(case_range))
            raise CorruptPart(f"its rows: {e}" if isinstance(e, CorruptPart) else "the file of its rows is missing") from None

    def read_part(self, case_range: CaseRange, columns: list[str] | None = None) -> tuple[pyarrow.Table, int]:
        """The table in the part of a range of cases, and the size of the part in bytes. Raises CorruptPart when the part is
        missing, unreadable or damaged."""
        try:
            data = self.read(self.part(case_range))
        except FileNotFoundError:
            raise CorruptPart("it is missing") from None
        except StorageError:
            raise  # the storage is probably unavailable for some time
        except OSError as e:
            raise CorruptPart(f"the file cannot be read: {e.strerror or e}") from e
        return read_part_bytes(data, case_range, columns), len(data)

    def part_outcomes(self, case_range: CaseRange) -> tuple[dict[str, int], int, str] | None:
        """Numbers of cases by outcome in the part of a range of cases, size in bytes with rows, and version that computed the part.
        None without a valid part."""
        try:
            table, size = self.read_part(case_range, ["outcome"])
        except CorruptPart:
            return None
        rows = self.rows_part(case_range)
        size += int(self.fs.size(rows)) if self.exists(rows) else 0
        return count_by(table), size, version_of(table)

    def exists(self, path: str) -> bool:
        """Whether a file exists at present. The function does not use the cache of the file system."""
        self.fs.invalidate_cache()
        return bool(self.fs.exists(path))

    def names(self, job: str) -> set[str]:
        """The names of a job's files at present. The function does not use the cache of the file system."""
        self.fs.invalidate_cache()
        try:
            return {str(x).rpartition("/")[2] for x in self.fs.ls(f"{self.root}/{job}", detail=False)}
        except FileNotFoundError:
            return set()

    def read(self, path: str) -> bytes:
        data: Any = self.fs.cat_file(path)
        return bytes(data)

    def read_end(self, path: str, most: int = 65_536) -> bytes:
        """The last bytes of a file, at most ``most``."""
        data: Any = self.fs.cat_file(path, start=-min(most, int(self.fs.size(path))))
        return bytes(data)

    def folders(self) -> list[str]:
        """The folders of all jobs."""
        try:
            return [str(x).rstrip("/") for x in self.fs.ls(self.root, detail=False)]
        except FileNotFoundError:
            return []

    def remove(self, job: str) -> None:
        """Remove the files of a job."""
        with suppress(FileNotFoundError):
            self.fs.rm(f"{self.root}/{job}", recursive=True)

    def check(self) -> None:
        """Raise OSError when no file can be written."""
        path = f"{self.root}/.check-{secrets.token_hex(6)}"
        self.write(path, b"ok")
        self.fs.rm_file(path)

    def marker(self, job: str) -> str:
        """Path of the stop marker of a job."""
        return f"{self.root}/{job}/stopped"

    def stage_file(self, job: str) -> str:
        """Path of the file with the stage of a job."""
        return f"{self.root}/{job}/stage"

    def job_file(self, job: str) -> str:
        """Path of the file with the job's document."""
        return f"{self.root}/{job}/job.json"
