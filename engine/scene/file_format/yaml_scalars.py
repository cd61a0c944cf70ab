"""Plain YAML scalars by the YAML 1.2 core schema: null, true, false, integers and floats; everything else is text."""

from __future__ import annotations

import re

_INT = re.compile(r"[-+]?[0-9]+", re.ASCII)
_RADIX = re.compile(r"0o([0-7]{1,60})|0x([0-9a-fA-F]{1,60})", re.ASCII)
_FLOAT = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?", re.ASCII)
_NAMED = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
_INFINITE = re.compile(r"([-+]?)\.(?:inf|Inf|INF)")
LONGEST_INTEGER = 300
"""An integer with this many digits or more is read as a float. An integer beyond the range of floats becomes infinite."""


def plain(text: str) -> object:
    """The value of an unquoted scalar: null, a truth value, a number or text."""
    if text in _NAMED:
        return _NAMED[text]
    if _INT.fullmatch(text):
        return int(text) if len(text) < LONGEST_INTEGER else float(text)
    if m := _RADIX.fullmatch(text):
        return int(m[1], 8) if m[1] else int(m[2], 16)
    if _FLOAT.fullmatch(text):
        return float(text)
    if m := _INFINITE.fullmatch(text):
        return float(f"{m[1]}inf")
    return float("nan") if text in (".nan", ".NaN", ".NAN") else text


def whole_text(text: str) -> str:
    """The text as files can hold it: each unpaired surrogate becomes the replacement character, and each surrogate pair becomes one
    character."""
    if text.isascii() or not any("\ud800" <= c <= "\udfff" for c in text):
        return text
    return text.encode("utf-16", "surrogatepass").decode("utf-16", "replace")
