"""The python flavour: pythonfmu's loader, and a slave in the standard library that calls the native library lying beside it."""
from __future__ import annotations
PLATFORMS = ("linux64", "win64")
def contents(identifier, guid, listed, libraries):
    raise NotImplementedError
