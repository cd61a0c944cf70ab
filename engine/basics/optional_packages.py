"""Optional packages: which extra brings each, and the message when one is missing."""

from __future__ import annotations

import re
from functools import lru_cache
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from trunnion.basics.problems import Problem

PROJECT = "trunnion"
LAST = ("test", "bench")
"""Extras for development; named only if no other extra brings a package."""
REQUIREMENT = re.compile(r"^([\w.-]+).*;.*\bextra\s*==\s*['\"]([\w-]+)['\"]")


@lru_cache(maxsize=1)
def _extras() -> dict[str, set[str]]:
    """{extra: modules that it brings}, from the metadata of the installation, including extras within extras."""
    from importlib.metadata import PackageNotFoundError, requires

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
    """Import name of a package. For all packages required here it differs only in case and dashes."""
    return re.sub(r"[-.]", "_", package).lower()


def extra_of(module: str) -> str:
    """The smallest extra that brings a module (``service`` for ``sqlalchemy.orm``); "": none."""
    name = _module(module.partition(".")[0])
    able = [extra for extra, modules in _extras().items() if name in modules]
    return min(able, key=lambda extra: (extra in LAST, len(_extras()[extra])), default="")


def brings(extra: str, module: str) -> bool:
    """Whether an extra brings a module."""
    return _module(module.partition(".")[0]) in _extras().get(extra, ())


def absent(extra: str, use: str) -> list[Problem]:
    """Problems for the missing packages of an extra. use: what needs them."""
    missing = sorted(m for m in _extras().get(extra, ()) if not there(m))
    what = f"needs {', '.join(missing)}, which {'is' if len(missing) == 1 else 'are'} not installed"
    return [Problem(use, what, remedy(extra))] if missing else []


def there(module: str) -> bool:
    """Whether a module can probably be imported; it is not imported."""
    try:
        return find_spec(module) is not None
    except ValueError:  # a module that a program made by hand has no specification to find
        return True


def remedy(extra: str) -> str:
    """The hint for a missing extra: the command to type."""
    return f"pip install '{PROJECT}[{extra}]'"


class Missing(ImportError):
    """A package is missing that an extra brings."""

    def __init__(self, text: str, extra: str, module: str):
        super().__init__(text, name=module)
        self.extra = extra


def brought(module: str, extra: str, use: str) -> Any:
    """A module that an extra brings; Missing, with the command to type, if it is missing. use: what needs it."""
    try:
        return import_module(module)
    except ImportError as e:
        raise Missing(f"{use} needs the package {module}, which is not installed: {remedy(extra)}", extra, module) from e
