"""Optional packages. For each package, the module finds the extra that installs the package, and gives the message when the package
is missing."""

from __future__ import annotations

import re
from functools import lru_cache
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from trunnion.basics.errors import Problem

PROJECT = "trunnion"
LAST = ("test", "bench")
"""Extras for development. A message names such an extra only if no other extra installs the package."""
REQUIREMENT = re.compile(r"^([\w.-]+).*;.*\bextra\s*==\s*['\"]([\w-]+)['\"]")


@lru_cache(maxsize=1)
def _extras() -> dict[str, set[str]]:
    """The modules that each extra installs, by extra, from the metadata of the installation. The modules of an extra include the
    modules of the extras that it contains."""
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
    """The import name of a package. For all packages in extras, the import name differs from the package's name only in case and
    dashes."""
    return re.sub(r"[-.]", "_", package).lower()


def extra_of(module: str) -> str:
    """The smallest extra that installs a module (``service`` for ``sqlalchemy.orm``); "" if there is no such extra."""
    name = _module(module.partition(".")[0])
    able = [extra for extra, modules in _extras().items() if name in modules]
    return min(able, key=lambda extra: (extra in LAST, len(_extras()[extra])), default="")


def brings(extra: str, module: str) -> bool:
    """Whether an extra installs a module."""
    return _module(module.partition(".")[0]) in _extras().get(extra, ())


def absent(extra: str, use: str) -> list[Problem]:
    """A list with one problem, which names the missing packages of an extra. The list is empty if all packages are installed. use:
    the feature that needs the packages."""
    missing = sorted(m for m in _extras().get(extra, ()) if not there(m))
    what = f"needs {', '.join(missing)}, which {'is' if len(missing) == 1 else 'are'} not installed"
    return [Problem(use, what, remedy(extra))] if missing else []


def there(module: str) -> bool:
    """Whether a module is installed. The test does not import the module."""
    try:
        return find_spec(module) is not None
    except ValueError:  # a program made this module object, and sys.modules holds it without a specification
        return True


def remedy(extra: str) -> str:
    """A hint: the command that installs an extra."""
    return f"pip install '{PROJECT}[{extra}]'"


class Missing(ImportError):
    """An optional package is not installed. extra: the extra that installs the package."""

    def __init__(self, text: str, extra: str, module: str):
        super().__init__(text, name=module)
        self.extra = extra


def brought(module: str, extra: str, use: str) -> Any:
    """Import a module that an extra installs. If the module is absent, raises Missing with the command that installs the extra.
    use: the feature that needs the module."""
    try:
        return import_module(module)
    except ImportError as e:
        raise Missing(f"{use} needs the package {module}, which is not installed: {remedy(extra)}", extra, module) from e


class Later:
    """A module that an extra installs, imported at the first use of one of its names. Raises Missing at once if the package is
    absent. (scipy's modules would take a quarter of the start-up time, and most processes never use them.)"""

    def __init__(self, module: str, extra: str, use: str):
        self._source = (module, extra, use)
        package = module.partition(".")[0]
        if not there(package):
            raise Missing(f"{use} needs the package {package}, which is not installed: {remedy(extra)}", extra, module)

    def __getattr__(self, name: str) -> Any:
        found = getattr(brought(*self._source), name)
        setattr(self, name, found)
        return found
