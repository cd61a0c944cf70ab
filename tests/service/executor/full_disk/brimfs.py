"""A file system for tests, at brim://folder: a local folder that can be full or fail. The folder may contain two lists. FULL: no
file can be written whose path contains a line of this list. FAILS: no file can be read or written whose path contains a line of
this list; the error is not an OSError, as with some packages of storages."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import Any

from fsspec import AbstractFileSystem
from fsspec.implementations.local import LocalFileSystem


class PackageError(Exception):
    """An error of a package's own type."""


def listed(name: str, path: str) -> bool:
    """Whether a path contains a line of the file ``name`` in one of its folders."""
    lists = [folder / name for folder in Path(path).parents if (folder / name).exists()]
    return any(line and line in path for file in lists for line in file.read_text().splitlines())


class BrimFileSystem(AbstractFileSystem):
    """The functions of a file system that parts need. They call the local file system."""

    protocol = "brim"
    cachable = False

    def __init__(self, **more: Any) -> None:
        super().__init__(**more)
        self.local = LocalFileSystem()

    @classmethod
    def _strip_protocol(cls, path: str) -> str:
        return str(path).removeprefix("brim://").rstrip("/")

    def pipe_file(self, path: str, value: bytes, mode: str = "overwrite", **more: Any) -> None:
        place = self._strip_protocol(path)
        if listed("FULL", place):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), place)
        if listed("FAILS", place):
            raise PackageError("try again later")
        self.local.pipe_file(place, value)

    def makedirs(self, path: str, exist_ok: bool = False) -> None:
        self.local.makedirs(self._strip_protocol(path), exist_ok)

    def cat_file(self, path: str, start: int | None = None, end: int | None = None, **more: Any) -> bytes:
        place = self._strip_protocol(path)
        if listed("FAILS", place):
            raise PackageError("try again later")
        return bytes(self.local.cat_file(place, start, end))

    def exists(self, path: str, **more: Any) -> bool:
        return bool(self.local.exists(self._strip_protocol(path)))

    def rm_file(self, path: str) -> None:
        self.local.rm_file(self._strip_protocol(path))

    def ls(self, path: str, detail: bool = True, **more: Any) -> list[Any]:
        return list(self.local.ls(self._strip_protocol(path), detail))
