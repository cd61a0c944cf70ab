"""Figures as PNG, SVG or PDF files. Files contain no dates and no random ids, so that the same run gives the same bytes."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from trunnion.basics.atomic_files import writing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SUFFIXES = (".png", ".svg", ".pdf")
DPI = 130
COLOURS = 96
"""Number of colours of a reduced PNG. With this number, thin lines keep their colours."""
_METADATA: dict[str, dict[str, str | None]] = {
    ".png": {"Software": "Trunnion"},
    ".svg": {"Date": None, "Creator": "Trunnion"},
    ".pdf": {"CreationDate": None, "Producer": "Trunnion", "Creator": "Trunnion"},
}


def save_figure(fig: Figure, path: str | os.PathLike[str], dpi: int = DPI) -> Path:
    """Write the figure in the format of the suffix. SceneError for another suffix or an unwritable folder."""
    import matplotlib as mpl

    with writing(path, SUFFIXES) as work, mpl.rc_context({"svg.hashsalt": "trunnion", "svg.fonttype": "none"}):
        suffix = work.suffix.lower()
        fig.savefig(work, format=suffix[1:], dpi=dpi, metadata=_METADATA[suffix])
    return Path(path)


def reduce_colours(path: Path) -> Path:
    """Rewrite the picture with ``COLOURS`` colours. The file then has a third of the bytes."""
    from PIL import Image

    with Image.open(path) as picture:
        reduced = picture.convert("RGB").quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    reduced.save(path, optimize=True)
    return path
