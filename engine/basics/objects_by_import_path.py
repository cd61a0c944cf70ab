"""Objects of a package, imported by their paths, so that a registry has one line for each object."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from typing import Any


def objects(package: str, paths: Iterable[str]) -> list[Any]:
    """The objects with these paths, "module.NAME" relative to the package, in the order of the paths."""
    return [getattr(import_module(f"{package}.{module}"), name) for module, name in (p.split(".") for p in paths)]
