"""Shell-style patterns over names such as ``ball.contact[1].angle``. Only ``*`` and ``?`` are wild cards; brackets are literal."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from fnmatch import translate

MOST_WILD = 1000
"""Largest number of patterns with wild cards in one list. The number is limited because each pattern is compared with every name.
The number of plain names is unlimited."""


def is_wild(pattern: str) -> bool:
    """Whether a pattern has wild cards."""
    return "*" in pattern or "?" in pattern


def matcher(patterns: Iterable[str]) -> Callable[[str], bool]:
    """A function that tells whether a name matches at least one of the patterns. Patterns with wild cards are compiled once."""
    every = tuple(patterns)
    plain = frozenset(p for p in every if not is_wild(p))
    wild = "|".join(translate(p.replace("[", "[[]")) for p in dict.fromkeys(every) if is_wild(p))
    match = re.compile(wild or r"(?!)").match  # if no pattern has wild cards, the expression matches no name
    return lambda name: name in plain or match(name) is not None


def suggestion(word: str, names: Iterable[str], otherwise: str = "", most: int = 1, cutoff: float = 0.6) -> str:
    """The hint "did you mean …?" with up to ``most`` names similar to a word; ``otherwise`` if no name is similar. cutoff: smallest
    similarity, between 0 and 1."""
    from difflib import get_close_matches

    near = get_close_matches(word, list(names), most, cutoff)
    return f"did you mean {', '.join(near)}?" if near else otherwise


def unmatched(patterns: Iterable[str], names: Iterable[str]) -> list[str]:
    """The patterns that match no name, without repetitions."""
    known = tuple(names)
    there = frozenset(known)
    return [p for p in dict.fromkeys(patterns) if not (any(map(matcher((p,)), known)) if is_wild(p) else p in there)]
