"""The help of ``trunnion``, stored in ``help.txt``, and the completion of command names in bash. This module does not import typer,
because that import takes twice as long as the start of Python."""

from __future__ import annotations

import os
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

WIDTH = 80
"""Columns of the stored text. Wider terminals get the same text."""


def stored_answer(words: Sequence[str]) -> str | None:
    """The text to print. For other requests, and on narrow terminals, the result is None, and typer answers."""
    completed = os.environ.get("_TRUNNION_COMPLETE")
    if completed is None and words in (["--help"], ["-h"]):
        if _terminal_width() < WIDTH:
            return None
        with open(os.path.join(os.path.dirname(__file__), "help.txt"), encoding="utf-8") as f:
            return f.read()
    typed = os.environ.get("COMP_WORDS", "").split()[1:]
    if completed == "complete_bash" and os.environ.get("COMP_CWORD") == "1" and (not typed or typed[0].isalpha()):
        from trunnion.cli.command_registry import COMMANDS

        names = dict.fromkeys(n.split()[0] for n in COMMANDS)
        return "\n".join([n for n in names if n.startswith("".join(typed[:1]))]) + "\n"
    return None


def _terminal_width() -> int:
    """Width of the terminal in columns, by the method of ``shutil``. The imports of ``shutil`` and ``pathlib`` would take as long
    as the start of Python."""
    given = os.environ.get("COLUMNS", "")
    if given.isdecimal() and int(given) > 0:
        return int(given)
    try:
        return os.get_terminal_size(sys.stdout.fileno()).columns or WIDTH
    except (AttributeError, ValueError, OSError):
        return WIDTH
