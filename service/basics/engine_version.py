"""The version of the engine, with a digest of its sources."""

from __future__ import annotations

import os
from functools import lru_cache
from hashlib import sha256

import trunnion
from trunnion.basics.version import version

SOURCES = (".py", ".c", ".h")
APART = ("cli", "fmu", "plots", "service", "__pycache__")
"""Folders that do not determine the rows of a case."""


@lru_cache(maxsize=1)
def engine_version() -> str:
    """The version of the engine and a digest of its sources, such as "0.1.0+1a2b3c4d". If two checkouts of one version have
    different sources, their digests differ."""
    root, digest, found = os.path.dirname(str(trunnion.__file__)), sha256(), list[str]()
    for folder, folders, files in os.walk(root):
        folders[:] = [f for f in folders if f not in APART]
        found += [os.path.join(folder, f) for f in files if f.endswith(SOURCES)]
    for path in sorted(found):
        with open(path, "rb") as f:  # os.walk, because pathlib would take four times as long
            digest.update(f.read())
    return f"{version()}+{digest.hexdigest()[:8]}"
