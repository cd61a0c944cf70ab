"""Hints of the kind "did you mean …?": the known name closest to what was written."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

LISTED = 12
"""Names a hint lists, at most."""


@dataclass(frozen=True)
class Nearest:
    """A hint that is looked for only when it is put into words: the closest of names, of which a scene may have thousands.

    word: what was written; known: the names there are; what: what they are called; otherwise: the hint when there are none.
    """

    word: str
    known: Iterable[str] = field(compare=False)
    what: str = "known"
    otherwise: str = ""

    def __str__(self) -> str:
        return did_you_mean(self.word, self.known, self.what) or self.otherwise


def closest(word: str, known: Iterable[str]) -> str:
    """The known name most like ``word``, '' when none is close. A name that differs only in upper and lower case always counts
    as close."""
    from difflib import get_close_matches

    names = [str(k) for k in known]
    folded = {n.casefold(): n for n in reversed(names)}
    if word.casefold() in folded:
        return folded[word.casefold()]
    found = get_close_matches(word.casefold()[:80], list(folded), n=1, cutoff=0.6)
    return folded[found[0]] if found else ""


def did_you_mean(word: str, known: Iterable[str], what: str = "known") -> str:
    """A hint: the closest name; when none is close, the first of the known names; '' when there are none."""
    names = [str(k) for k in known]
    best = closest(word, names)
    if best:
        return f'did you mean "{best}"?'
    if not names:
        return ""
    return f"{what}: {listed(names)}"


def listed(names: Iterable[str]) -> str:
    """Names separated by commas; of many, only the first ones."""
    every = list(names)
    return ", ".join(every[:LISTED]) + (", …" if len(every) > LISTED else "")


def shown(value: object, limit: int = 40) -> str:
    """A value as the user would recognise it, cut to ``limit`` characters."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        text = value if len(value) <= limit else value[: limit - 1] + "…"
        return f'"{text}"'
    if isinstance(value, dict):
        return "a group of keys"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}"
    if isinstance(value, int | float):
        return _cut(repr(value) if isinstance(value, float) else _integer(value), limit)
    return "a value of another kind"


def _integer(value: int) -> str:
    return str(value) if value.bit_length() < 200 else "a number of more than 60 digits"


def _cut(text: str, limit: int) -> str:
    return text if len(text) <= limit else text[: limit - 1] + "…"
