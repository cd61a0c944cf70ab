"""Shell-style patterns over names like ``ball.contact[1].angle``: ``*`` and ``?`` only; brackets are brackets."""

from __future__ import annotations

from fnmatch import fnmatchcase


def matches(name: str, pattern: str) -> bool:
    """Whether a name matches a pattern."""
    return fnmatchcase(name, pattern.replace("[", "[[]"))
