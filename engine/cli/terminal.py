"""What the terminal at the other end can show, and wants to be shown (https://no-color.org; TERM=dumb)."""

from __future__ import annotations

import os
from typing import TextIO


def moves(stream: TextIO) -> bool:
    """Whether a bar can be drawn over and over again: on a terminal that can go back."""
    return stream.isatty() and os.environ.get("TERM") != "dumb"


def coloured(stream: TextIO) -> bool:
    """Whether colours are understood and wanted."""
    return moves(stream) and not os.environ.get("NO_COLOR")
