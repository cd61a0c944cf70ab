"""Hints such as "did you mean …?", with the known name closest to a misspelled word."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field
from functools import lru_cache

from trunnion.basics.lazy_data_classes import dataclass

LISTED = 12
"""Largest number of names in a hint."""


@dataclass(frozen=True)
class Nearest:
    """A hint with the known name closest to a word. The search runs only in ``str``, because a scene may have thousands of names.

    word       the text that the user wrote
    known      the existing names
    what       the word for such names in the hint
    otherwise  the hint when there are no names
    """

    word: str
    known: Iterable[str] = field(compare=False)
    what: str = "known"
    otherwise: str = ""

    def __str__(self) -> str:
        return did_you_mean(self.word, self.known, self.what) or self.otherwise


def closest(word: str, known: Iterable[str]) -> str:
    """The known name most similar to ``word``; '' when no name is close. A name that differs only in upper and lower case is
    always close."""
    return _closest(word, tuple(map(str, known)))


@lru_cache(maxsize=1024)  # repeated mistakes, and a second validation, search for the same words
def _closest(word: str, names: tuple[str, ...]) -> str:
    from difflib import get_close_matches

    folded = {n.casefold(): n for n in reversed(names)}
    if word.casefold() in folded:
        return folded[word.casefold()]
    found = get_close_matches(word.casefold()[:80], list(folded), n=1, cutoff=0.6)
    return folded[found[0]] if found else ""


def did_you_mean(word: str, known: Iterable[str], what: str = "known") -> str:
    """A hint with the closest known name. If no name is close, the hint lists the first known names. Without known names the hint
    is ''."""
    names = [str(k) for k in known]
    best = closest(word, names)
    if best:
        return f'did you mean "{best}"?'
    return f"{what}: {listed(names)}" if names else ""


def listed(names: Iterable[str]) -> str:
    """The first ``LISTED`` names, separated by commas."""
    every = list(names)
    return ", ".join(every[:LISTED]) + (", …" if len(every) > LISTED else "")


def shown(value: object, limit: int = 40) -> str:
    """A value as text that the user recognises, cut to ``limit`` characters."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f'"{_cut(value, limit)}"'
    if isinstance(value, dict):
        return "a group of keys"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}"
    if isinstance(value, int | float):
        whole = isinstance(value, int) and value.bit_length() >= 200
        return "a number of more than 60 digits" if whole else _cut(repr(value), limit)
    return "a value of another kind"


def _cut(text: str, limit: int) -> str:
    return text if len(text) <= limit else text[: limit - 1] + "…"
