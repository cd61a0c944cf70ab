"""Shell-style patterns over names like ``ball.contact[1].angle``. Only ``*`` and ``?`` are wild cards; brackets stand for
themselves."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from fnmatch import translate

MOST_WILD = 1000
"""Patterns with wild cards in one list, at most: each is tried at every name. Names written out are as many as one likes."""


def is_wild(pattern: str) -> bool:
    """Whether a pattern has wild cards, and so may stand for more than one name."""
    return "*" in pattern or "?" in pattern


def matcher(patterns: Iterable[str]) -> Callable[[str], bool]:
    """A function that tells whether a name matches one of the patterns. Patterns are compiled once, and those without wild
    cards are looked up."""
    every = tuple(patterns)
    plain = frozenset(p for p in every if not is_wild(p))
    wild = [re.compile(translate(p.replace("[", "[[]"))).match for p in dict.fromkeys(every) if is_wild(p)]
    return lambda name: name in plain or any(match(name) for match in wild)


def unmatched(patterns: Iterable[str], names: Iterable[str]) -> list[str]:
    """The patterns that match none of the names, each once."""
    known = tuple(names)
    there = frozenset(known)
    return [p for p in dict.fromkeys(patterns) if not (any(map(matcher((p,)), known)) if is_wild(p) else p in there)]
