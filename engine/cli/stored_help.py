"""Answers without typer, whose import takes twice as long as Python's own start. The answers are the help of ``trunnion``, which
``help.txt`` stores, and the names of commands for completion in bash."""

from __future__ import annotations

import os
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

WIDTH = 80
"""Columns of the stored text. Wider terminals get the same text."""


def stored_answer(words: Sequence[str]) -> str | None:
    """What to print; None if typer must answer: other requests, and narrow terminals."""
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
    """Columns of the terminal, as ``shutil`` finds them; ``shutil`` and ``pathlib`` take as long as Python's own start."""
    given = os.environ.get("COLUMNS", "")
    if given.isdecimal() and int(given) > 0:
        return int(given)
    try:
        return os.get_terminal_size(sys.stdout.fileno()).columns or WIDTH
    except (AttributeError, ValueError, OSError):
        return WIDTH
