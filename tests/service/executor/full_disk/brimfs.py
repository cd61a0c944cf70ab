"""A file system for tests, at brim://folder: a local folder that can be full. The folder may contain a file named FULL. Then no
file can be written whose path contains one of the lines of FULL."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import Any

from fsspec import AbstractFileSystem
from fsspec.implementations.local import LocalFileSystem


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
        place = Path(self._strip_protocol(path))
        for folder in place.parents:
            if (folder / "FULL").exists() and any(w and w in str(place) for w in (folder / "FULL").read_text().splitlines()):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(place))
        self.local.pipe_file(str(place), value)

    def makedirs(self, path: str, exist_ok: bool = False) -> None:
        self.local.makedirs(self._strip_protocol(path), exist_ok)

    def cat_file(self, path: str, start: int | None = None, end: int | None = None, **more: Any) -> bytes:
        return bytes(self.local.cat_file(self._strip_protocol(path), start, end))

    def exists(self, path: str, **more: Any) -> bool:
        return bool(self.local.exists(self._strip_protocol(path)))

    def rm_file(self, path: str) -> None:
        self.local.rm_file(self._strip_protocol(path))

    def ls(self, path: str, detail: bool = True, **more: Any) -> list[Any]:
        return list(self.local.ls(self._strip_protocol(path), detail))
