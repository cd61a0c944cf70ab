"""A moving picture of a run as one HTML file: data, style and viewer inside it, nothing fetched from anywhere."""

from __future__ import annotations

import html
import json
import os
from pathlib import Path

from engine.basics.files import writing
from engine.plots.playback import content
from engine.simulation.result import Result
from engine.simulation.tables import finite

SUFFIXES = (".html", ".htm")
VIEWER = Path(__file__).with_name("viewer")
SCRIPTS = (
    "data.js", "camera.js", "solids.js", "shaders.js", "gl.js", "paint.js", "traces.js", "flat.js", "show.js", "panel.js",
    "clock.js", "controls.js",
)  # fmt: skip
"""In this order: each uses what those before it define."""


def animate(result: Result, path: str | os.PathLike[str]) -> Path:
    """Write a self-contained page that shows the run; opened from disk at ``…html?t=0.5`` it starts at that time.

    SceneError when the result lacks positions and orientations, for another suffix than .html, or an unwritable folder.
    """
    text = page(result)
    with writing(path, SUFFIXES) as work:
        work.write_text(text, encoding="utf-8")
    return Path(path)


def page(result: Result) -> str:
    """The page as HTML text."""
    data = json.dumps(finite(content(result)), separators=(",", ":"), ensure_ascii=False).replace("<", "\\u003c")
    parts = {
        "title": html.escape(result.scene.title or result.scene.name),
        "style": (VIEWER / "style.css").read_text(encoding="utf-8"),
        "data": data,
        "script": "\n".join((VIEWER / name).read_text(encoding="utf-8") for name in SCRIPTS),
    }
    pieces = (VIEWER / "page.html").read_text(encoding="utf-8").split("{{")
    filled = [pieces[0]]
    for piece in pieces[1:]:
        key, _, rest = piece.partition("}}")
        filled += [parts[key], rest]
    return "".join(filled)
