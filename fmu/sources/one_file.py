"""Several C files as one: what they include of ours is put in its place, once."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

INCLUDE = re.compile(r'^#include "([^"]+)"\n', re.MULTILINE)
GUARD = re.compile(r"\A((?:/\*.*?\*/\s*)*)#ifndef (\w+_H)\n#define \2\n(.*)#endif\n\Z", re.DOTALL)
SYSTEM = re.compile(r"^#include <[^>]+>\n", re.MULTILINE)


def one_file(start: str, find: Callable[[str], str | None], alone: bool = False) -> str:
    """``start`` with all it includes. find: the text of a file by its name; None: it is left to be included.
    alone: FMU_ALONE is defined."""
    seen: set[str] = set()

    def text_of(found: re.Match[str]) -> str:
        name = found[1]
        text = find(name)
        if text is None:
            return found[0]
        if name in seen:
            return ""
        seen.add(name)
        return INCLUDE.sub(text_of, _unguarded(text))

    return _system_first(decided(INCLUDE.sub(text_of, start), "FMU_ALONE", alone))


def in_folders(folders: Sequence[Path], made: Mapping[str, str], left: Sequence[str] = ()) -> Callable[[str], str | None]:
    """Finds files: those in ``made``, then those in folders; those in ``left`` stay includes."""

    def find(name: str) -> str | None:
        if name in left:
            return None
        if name in made:
            return made[name]
        return next(((f / name).read_text() for f in folders if (f / name).is_file()), None)

    return find


def decided(text: str, name: str, defined: bool) -> str:
    """The text with ``#if defined NAME`` … ``#else`` … ``#endif`` decided."""
    branch = re.compile(rf"^#if defined {name}\b[^\n]*\n(.*?)^#else\n(.*?)^#endif\n", re.MULTILINE | re.DOTALL)
    return branch.sub(lambda found: found[1 if defined else 2], text)


def _unguarded(text: str) -> str:
    """A header without its guard: it is there once."""
    found = GUARD.match(text)
    return found[1] + found[3] if found else text


def _system_first(text: str) -> str:
    """The C library's headers once each, before all else."""
    headers = sorted(set(SYSTEM.findall(text)))
    return "".join(headers) + SYSTEM.sub("", text)
