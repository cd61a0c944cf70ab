"""A moving picture of a run: one HTML file with data, style and viewer inside it, nothing fetched from anywhere; or a film."""

from __future__ import annotations

import html
import json
import os
from collections.abc import Callable
from pathlib import Path

from engine.basics.files import writing
from engine.plots.film import SUFFIXES as FILMS
from engine.plots.film import film
from engine.plots.playback import content
from engine.simulation.result import Result
from engine.simulation.tables import finite

PAGES = (".html", ".htm")
SUFFIXES = (*PAGES, *FILMS)
VIEWER = Path(__file__).with_name("viewer")
SCRIPTS = (
    "data.js", "camera.js", "solids.js", "shaders.js", "gl.js", "paint.js", "traces.js", "flat.js", "show.js", "panel.js",
    "clock.js", "controls.js",
)  # fmt: skip
"""In this order: each uses what those before it define."""


def animate(result: Result, path: str | os.PathLike[str], tell: Callable[[float, float], None] | None = None) -> Path:
    """Write a self-contained page that shows the run (opened from disk at ``…html?t=0.5`` it starts at that time), or a film.

    tell: (time reached, last time), s, after every frame of a film. SceneError when the result lacks positions and orientations,
    for a suffix not in ``SUFFIXES``, an unwritable folder, or MP4 without the extra ``video``.
    """
    with writing(path, SUFFIXES) as work:
        if work.suffix.lower() in FILMS:
            film(result, work, tell=tell)
        else:
            work.write_text(page(result), encoding="utf-8")
    return Path(path)


def page(result: Result, shown: str = "") -> str:
    """The page as HTML text. shown: how it opens where its address does not say, such as "t=0.5&names=1"
    (``viewer/README.md``)."""
    given = content(result) | {"shown": shown}
    data = json.dumps(finite(given), separators=(",", ":"), ensure_ascii=False).replace("<", "\\u003c")
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
