"""The environments in which pages run: each is a copy of the checkout with a ``.venv`` that holds the packages that the pages
install.

The project without extras, which every page installs first, is installed once. Later environments begin as copies of that
environment (files are hard links). The line of the page then runs with "trunnion" or "trunnion[extra]" in place of "." or
".[extra]". Otherwise, building the project again would take half of the time. At the end, each environment contains exactly the
packages that its pages install. """

from __future__ import annotations

import os
import re
import shutil
import time
from contextlib import suppress
from dataclasses import dataclass, field
from importlib.metadata import Distribution, distributions
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.documentation.code_blocks import PLAIN

BASE = re.compile(r"^python3 -m venv \.venv && (?:\. \.venv/bin/activate && )?(?:\.venv/bin/)?pip install -q \.(?: |$)")
"""The line that creates an environment with the project and without extras."""
EXTRAS = re.compile(r"pip install .*(?:\.|trunnion)\[([\w,]+)\]")
PATIENCE = 600.0
"""Seconds to wait for another process's environment. A process waits so long only if the other process has failed. It then makes
its own environment."""
WITH_PYTHON = {"pip", "setuptools", "wheel"}
"""Packages that ``python -m venv`` may put into an environment by itself."""


@dataclass
class Home:
    """A copy of the checkout. path: its folder; shared: a folder that the homes of one test session have in common; typed: the
    installation lines that ran in this home."""

    path: Path
    shared: Path
    typed: list[str] = field(default_factory=list)
    copied: bool = False
    """True if the environment began as a copy of another environment."""

    @property
    def venv(self) -> Path:
        """Folder of the environment."""
        return self.path / ".venv"

    def begin(self, line: str) -> None:
        """Copy the session's environment without extras before ``line`` runs. The first home of the session with this line creates
        this environment; all other homes wait for it."""
        base, maker = self.shared / "base", self.shared / "base.maker"
        if BASE.match(line) and not maker.exists():
            with suppress(FileExistsError):
                maker.touch(exist_ok=False)
                return
        end = time.monotonic() + PATIENCE
        while maker.exists() and not base.exists() and time.monotonic() < end:
            time.sleep(0.2)
        if not self.venv.exists() and base.exists():
            linked(base / "venv", self.venv, (base / "place").read_bytes())
            self.copied = True

    def typed_now(self, line: str) -> None:
        """Record an installation. The session's first installation without extras is stored for later environments."""
        if BASE.match(line) and not self.typed and not self.copied:
            mine = self.shared / f"base-{os.getpid()}"
            linked(self.venv, mine / "venv", bytes(self.venv))
            (mine / "place").write_bytes(bytes(self.venv))
            with suppress(OSError):  # another process has made the folder first
                mine.rename(self.shared / "base")
        self.typed.append(line)

    @property
    def extras(self) -> set[str]:
        """Extras of this project that were typed here."""
        return {extra for line in self.typed for found in EXTRAS.findall(line) for extra in found.split(",")}

    def surplus(self) -> tuple[set[str], set[str]]:
        """Names of the distributions in the environment that no typed line requires, and names of missing distributions."""
        (site,) = self.venv.glob("lib/python*/site-packages")
        there = {canonicalize_name(d.metadata["Name"]): d for d in distributions(path=[str(site)])}
        asked = needed(there, "trunnion", self.extras)
        return set(there) - asked - WITH_PYTHON, asked - set(there)


def needed(there: dict[str, Distribution], name: str, extras: set[str]) -> set[str]:
    """A distribution and all distributions that it requires with these extras, directly or indirectly."""
    seen: set[tuple[str, str]] = set()
    todo = [(canonicalize_name(name), extra) for extra in ("", *extras)]
    while todo:
        name, extra = step = todo.pop()
        if step in seen:
            continue
        seen.add(step)
        for text in (there[name].requires or []) if name in there else []:
            wanted = Requirement(text)
            if wanted.marker is None or wanted.marker.evaluate({"extra": extra}):
                todo += [(canonicalize_name(wanted.name), e) for e in ("", *wanted.extras)]
    return {name for name, _ in seen}


def linked(old: Path, new: Path, place: bytes) -> None:
    """Copy an environment that was made at ``place``. Packages are hard links. Scripts and settings contain the path of their
    environment, so they are copied. In a ``.venv``, the scripts get the new path."""
    shutil.copytree(old, new, symlinks=True, ignore=shutil.ignore_patterns("lib"))
    shutil.copytree(old / "lib", new / "lib", symlinks=True, copy_function=link)
    if new.name == ".venv":
        for script in (new / "bin").iterdir():
            if not script.is_symlink():
                script.write_bytes(script.read_bytes().replace(place, bytes(new)))


def link(old: str, new: str) -> str:
    """Make a hard link to a file, or a copy if the file system has no hard links."""
    try:
        os.link(old, new)
    except OSError:
        shutil.copy2(old, new)
    return new


def copied(root: Path, home: Path) -> Path:
    """A copy of the checkout without environments, caches and other files that are not part of it."""
    ignore = shutil.ignore_patterns(*PLAIN, ".*_cache", ".hypothesis", "trunnion-data", "node_modules")
    return Path(shutil.copytree(root, home, ignore=ignore))
