"""Help of ``trunnion``, stored in ``help.txt``, and completion of command names in bash, both without typer. The import of typer
takes twice as long as Python's own start."""

from __future__ import annotations

import os
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

WIDTH = 80
"""Columns of the stored text. Wider terminals get the same text."""


def stored_answer(words: Sequence[str]) -> str | None:
    """The text to print. None if typer must answer: for other requests, and on narrow terminals."""
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
    """Width of the terminal in columns, found as ``shutil`` finds it. The imports of ``shutil`` and ``pathlib`` would take as long
    as Python's own start."""
    given = os.environ.get("COLUMNS", "")
    if given.isdecimal() and int(given) > 0:
        return int(given)
    try:
        return os.get_terminal_size(sys.stdout.fileno()).columns or WIDTH
    except (AttributeError, ValueError, OSError):
        return WIDTH
