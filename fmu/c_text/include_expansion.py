"""Expansion of ``#include`` lines, which joins several C files into one text."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

INCLUDE = re.compile(r'^#include "([^"]+)"\n', re.MULTILINE)
GUARD = re.compile(r"\A((?:/\*.*?\*/\s*)*)#ifndef (\w+_H)\n#define \2\n(.*)#endif\n\Z", re.DOTALL)
SHELLS = ("FMU_FMI2", "FMU_FMI3", "FMU_ALONE")
"""Macros by which ``native/translation_unit.c`` selects the files that it includes."""
SYSTEM = re.compile(r"^#include <[^>]+>\n", re.MULTILINE)


def one_file(start: str, folders: Sequence[Path], made: Mapping[str, str], left: Sequence[str], shell: str) -> str:
    """The text ``start`` with its includes expanded. A file is in ``made``, or else in a folder. Include lines remain for files
    that are in neither, and for files named in ``left``. shell: the macro in SHELLS that is defined; "" for none."""
    seen: set[str] = set()

    def text_of(found: re.Match[str]) -> str:
        name = found[1]
        file = next((f / name for f in folders if (f / name).is_file()), None)
        text = made[name] if name in made else file.read_text() if file else None
        if name in left or text is None:
            return found[0]
        if name in seen:
            return ""
        seen.add(name)
        return expanded(_unguarded(text))

    def expanded(text: str) -> str:
        for name in SHELLS:
            text = decided(text, name, name == shell)
        return INCLUDE.sub(text_of, text)

    return _system_first(expanded(start))


def decided(text: str, name: str, defined: bool) -> str:
    """The text in which each block ``#if defined NAME`` … ``#else`` … ``#endif`` is replaced by its active branch. Lines ``#else``
    are optional. The blocks must not be nested."""
    branch = re.compile(rf"^#if defined {name}\b[^\n]*\n(.*?)(?:^#else\n(.*?))?^#endif\n", re.MULTILINE | re.DOTALL)
    return branch.sub(lambda found: found[1 if defined else 2] or "", text)


def _unguarded(text: str) -> str:
    """A header without its include guard."""
    found = GUARD.match(text)
    return found[1] + found[3] if found else text


def _system_first(text: str) -> str:
    """The text with the includes of C library headers moved to its beginning, each header once."""
    headers = sorted(set(SYSTEM.findall(text)))
    return "".join(headers) + SYSTEM.sub("", text)
