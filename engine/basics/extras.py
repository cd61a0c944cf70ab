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
def _extras() -> dict[str, set[str]]:
    """{extra: modules that it brings}, from the metadata of the installation. An extra that brings others has their packages."""
    try:
        lines = requires(PROJECT) or []
    except PackageNotFoundError:  # Trunnion is run from its sources, without an installation
        return {}
    found: dict[str, set[str]] = {}
    for m in filter(None, map(REQUIREMENT.match, lines)):
        if m[1] != PROJECT:
            found.setdefault(m[2], set()).add(_module(m[1]))
    return found


def _module(package: str) -> str:
    """A package's name as it is imported: for all packages we require it differs only in case and dashes."""
    return re.sub(r"[-.]", "_", package).lower()


def extra_of(module: str) -> str:
    """The extra that brings a module (``service`` for ``sqlalchemy.orm``) with the least besides; "" when none does."""
    name = _module(module.partition(".")[0])
    able = [extra for extra, modules in _extras().items() if name in modules]
    return min(able, key=lambda extra: (extra in LAST, len(_extras()[extra])), default="")


def brings(extra: str, module: str) -> bool:
    """Whether an extra brings a module."""
    return _module(module.partition(".")[0]) in _extras().get(extra, ())


def absent(extra: str, use: str) -> list[Problem]:
    """Problems to tell before anything begins: the packages of an extra that are not installed. use: what needs them."""
    missing = sorted(m for m in _extras().get(extra, ()) if not there(m))
    what = f"needs {', '.join(missing)}, which {'is' if len(missing) == 1 else 'are'} not installed"
    return [Problem(use, what, remedy(extra))] if missing else []


def there(module: str) -> bool:
    """Whether a module can be imported, as far as one knows without importing it."""
    try:
        return find_spec(module) is not None
    except ValueError:  # a module that a program made by hand has no specification to find
        return True


def remedy(extra: str) -> str:
    """The hint for a missing extra: the line to type."""
    return f"pip install '{PROJECT}[{extra}]'"


class Missing(ImportError):
    """A package is not there that an extra brings. extra: the one that brings all that its use needs."""

    def __init__(self, text: str, extra: str, module: str):
        super().__init__(text, name=module)
        self.extra = extra


def brought(module: str, extra: str, use: str) -> Any:
    """A module that an extra brings; Missing, with the line to type, when it is not there. use: what needs it."""
    try:
        return import_module(module)
    except ImportError as e:
        raise Missing(f"{use} needs the package {module}, which is not installed: {remedy(extra)}", extra, module) from e
