"""Packages that are not part of the plain installation: which extra brings them, and what to say when one is not there."""

from __future__ import annotations

import re
from functools import lru_cache
from importlib import import_module
from importlib.metadata import PackageNotFoundError, requires
from importlib.util import find_spec
from typing import Any

from engine.basics.problems import Problem

PROJECT = "trunnion"
LAST = ("test", "bench")
"""Extras for working on Trunnion itself, named only where no other brings a package."""
REQUIREMENT = re.compile(r"^([\w.-]+).*;.*\bextra\s*==\s*['\"]([\w-]+)['\"]")


@lru_cache(maxsize=1)
def _extras() -> dict[str, str]:
    """{module: name of the extra that brings it}, from the metadata of the installation."""
    try:
        lines = requires(PROJECT) or []
    except PackageNotFoundError:  # Trunnion is run from its sources, without an installation
        return {}
    found = [m.groups() for m in map(REQUIREMENT.match, lines) if m]
    return {_module(name): extra for name, extra in sorted(found, key=lambda f: f[1] in LAST, reverse=True)}


def _module(package: str) -> str:
    """A package's name as it is imported: for all packages we require it differs only in case and dashes."""
    return re.sub(r"[-.]", "_", package).lower()


def extra_of(module: str) -> str:
    """The extra that brings a module (``service`` for ``sqlalchemy.orm``); "" when none does."""
    return _extras().get(_module(module.partition(".")[0]), "")


def absent(extra: str, use: str) -> list[Problem]:
    """Problems to tell before anything begins: the packages of an extra that are not installed. use: what needs them."""
    missing = sorted(m for m, e in _extras().items() if e == extra and not _there(m))
    what = f"needs {', '.join(missing)}, which {'is' if len(missing) == 1 else 'are'} not installed"
    return [Problem(use, what, remedy(extra))] if missing else []


def _there(module: str) -> bool:
    try:
        return find_spec(module) is not None
    except ValueError:  # a module that a program made by hand has no specification to find
        return True


def remedy(extra: str) -> str:
    """The hint for a missing extra: the line to type."""
    return f"pip install '{PROJECT}[{extra}]'"


def brought(module: str, extra: str, use: str) -> Any:
    """A module that an extra brings; ImportError with the line to type when it is not there. use: what needs it."""
    try:
        return import_module(module)
    except ImportError as e:
        raise ImportError(f"{use} needs the package {module}, which is not installed: {remedy(extra)}", name=module) from e
