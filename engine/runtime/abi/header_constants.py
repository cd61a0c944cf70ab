"""Constants of the runtime for Python and the lanes, read from ``base/tolerances.h`` and ``base/stick_rule.h``."""

from __future__ import annotations

import re
from functools import cache, lru_cache
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[1] / "base"
TOLERANCES, STICK_RULE = FOLDER / "tolerances.h", FOLDER / "stick_rule.h"
DEFINITION = re.compile(r"^#define (\w+)[ \t]+(\S+)", re.MULTILINE)
FUNCTION = re.compile(r"^static inline .*\}$", re.MULTILINE)


@lru_cache(maxsize=1)
def _values() -> dict[str, str]:
    """C text of the value of every constant, by name."""
    return dict(d for file in (TOLERANCES, STICK_RULE) for d in DEFINITION.findall(file.read_text(encoding="utf-8")))


@cache
def number(name: str) -> float:
    """The value of a constant. Raises KeyError if the name is unknown."""
    value = _values()[name]
    return number(value) if value in _values() else float(value)


def used_by(text: str) -> str:
    """C definitions that a C text needs: the functions of the stick rule that the text names, and the constants that the text or
    these functions name."""
    rule = [f for f in FUNCTION.findall(STICK_RULE.read_text(encoding="utf-8")) if set(re.findall(r"tr_\w+", f)) & _words(text)]
    named = _words(text) | _words("\n".join(rule))
    return "".join(f"{line}\n" for line in [*(f"#define {n} {v}" for n, v in _values().items() if n in named), *rule])


def _words(text: str) -> set[str]:
    return set(re.findall(r"\w+", text))
