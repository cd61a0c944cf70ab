"""The YAML parser's event stream, with the parser's errors translated to plain messages."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from trunnion.scene.findings.findings_and_paths import Finding, Path


class Unreadable(Exception):
    """Raised when reading stops at a mistake; ``finding`` describes it."""

    def __init__(self, line: int, what: str, hint: str = "", path: Path = ()):
        super().__init__(what)
        self.finding = Finding(path, what, hint, line)


def events(text: str) -> Iterator[Any]:
    """The parser's events in order. Every error of the parser is raised as Unreadable. The parser is libyaml. If PyYAML comes
    without libyaml, PyYAML's parser in Python is used; it takes twenty times as long."""
    import yaml

    try:
        yield from yaml.parse(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    except yaml.MarkedYAMLError as e:
        mark = e.problem_mark or e.context_mark
        raise Unreadable(mark.line + 1 if mark else 0, *_syntax(str(e.problem or e.context or ""))) from e
    except yaml.YAMLError as e:
        raise Unreadable(_line_of_character(e, text), "a character that is not allowed in YAML", "remove it") from e
    except (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, NotImplementedError, AssertionError) as e:
        # the third-party parser raises such errors on malformed directives and escapes
        raise Unreadable(0, "not valid YAML") from e


def _line_of_character(error: Exception, text: str) -> int:
    position = getattr(error, "position", None)
    return text.count("\n", 0, position) + 1 if isinstance(position, int) else 0


_SYNTAX = {
    "mapping values are not allowed": ("a colon where YAML allows no key", "check the indentation; quote text with a colon"),
    "could not find expected ':'": ("a key without a colon", 'write "key: value", with a blank after the colon'),
    "cannot start any token": ("a character that cannot stand here", "indent with blanks, not tabs; put text in quotes"),
    "expected ',' or": ("a bracket is not closed", "look for a missing ], } or comma"),
    "expected <block end>": ("the indentation does not fit", "entries of one group start in the same column"),
    "expected key": ("the indentation does not fit", "entries of one group start in the same column"),
    "expected '-' indicator": ("the indentation does not fit", "entries of one list start in the same column"),
    "sequence entries are not allowed": ("a list entry where YAML allows none", "begin it on a line below its key"),
    "did not find expected": ("the brackets or the indentation do not fit", "look for a missing ], } or comma"),
    "unexpected end of stream": ("the text ends inside quotes", "close the quotes"),
    "found undefined alias": ("an alias (*name) without its anchor (&name)", ""),
    "found duplicate anchor": ("an anchor (&name) is defined twice", ""),
}


def _syntax(message: str) -> tuple[str, str]:
    for part, (what, hint) in _SYNTAX.items():
        if part in message:
            return f"not valid YAML: {what}", hint
    return f"not valid YAML: {' '.join(message.split())}", ""
