"""Objects of a package by text, so that a registry names each in one line."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from typing import Any


def objects(package: str, paths: Iterable[str]) -> list[Any]:
    """The objects with these paths, "module.NAME" below the package, in their order."""
    return [getattr(import_module(f"{package}.{module}"), name) for module, name in (p.split(".") for p in paths)]
