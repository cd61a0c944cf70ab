"""Whether a terminal redraws lines and shows colours (https://no-color.org; TERM=dumb)."""

from __future__ import annotations

import os
from typing import TextIO


def is_redrawable(stream: TextIO) -> bool:
    """Whether the stream is a terminal that can redraw a line."""
    return stream.isatty() and os.environ.get("TERM") != "dumb"


def has_colours(stream: TextIO) -> bool:
    """Whether the stream shows colours and the user wants colours."""
    return is_redrawable(stream) and not os.environ.get("NO_COLOR")
