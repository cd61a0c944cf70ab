"""Errors of a storage that is not a local folder reach the server as one type, whatever the storage's package raises."""

from __future__ import annotations

from functools import partial

import fsspec
import pytest
from fsspec.implementations.memory import MemoryFileSystem

from trunnion.service.executor.parquet_parts import Parts, StorageError

FUNCTIONS = ("makedirs", "pipe_file", "cat_file", "exists", "ls", "rm_file", "rm", "size")


class PackageError(Exception):
    """An error of a package's own type."""


@pytest.fixture
def parts() -> Parts:
    own = type("OddFileSystem", (MemoryFileSystem,), {"protocol": "odd", "store": {}})
    fsspec.register_implementation("odd", own, clobber=True)
    parts = Parts("odd://jobs")
    parts.write(parts.job_file("a"), b"{}")
    return parts


def fails(parts: Parts, monkeypatch: pytest.MonkeyPatch, error: Exception) -> None:
    """Let every function of the file system raise an error."""

    def raise_error(*_: object, **__: object) -> None:
        raise error

    for name in FUNCTIONS:
        monkeypatch.setattr(type(parts.fs.fs), name, raise_error)


@pytest.mark.parametrize(
    ("error", "text"),
    [(PackageError("try later"), "PackageError: try later"), (PermissionError(13, "not yours"), "[Errno 13] not yours")],
    ids=["package", "system"],
)
def test_every_operation_raises_a_storage_error_with_the_storages_own_text(
    parts: Parts, monkeypatch: pytest.MonkeyPatch, error: Exception, text: str
) -> None:
    fails(parts, monkeypatch, error)
    of_job, of_file = (parts.names, parts.remove), (parts.read, parts.read_end, parts.exists)
    calls = [partial(f, "a") for f in of_job] + [partial(f, parts.job_file("a")) for f in of_file]
    for call in (parts.check, parts.folders, *calls):
        with pytest.raises(StorageError) as caught:
            call()
        assert str(caught.value) == text


def test_a_missing_file_stays_a_missing_file(parts: Parts) -> None:
    with pytest.raises(FileNotFoundError):
        parts.read(parts.job_file("b"))
    assert (parts.names("b"), parts.read(parts.job_file("a"))) == (set(), b"{}")
