"""Animation of a run as a film, or as one HTML file. The HTML file contains data, style and viewer, and fetches nothing."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from trunnion.basics.atomic_files import writing
from trunnion.plots.animation.film import SUFFIXES as FILMS
from trunnion.plots.animation.film import film
from trunnion.plots.animation.viewer_data import content
from trunnion.plots.style.html_pages import make_html_page
from trunnion.simulation.results.result import Result

PAGES = (".html", ".htm")
SUFFIXES = (*PAGES, *FILMS)
VIEWER = Path(__file__).with_name("viewer")
SCRIPTS = (
    "run_data.js", "camera.js", "triangles_and_edges.js", "shaders.js", "webgl.js", "webgl_scene.js", "point_paths.js",
    "canvas_fallback.js", "point_handles.js", "picture_drawing.js", "value_panel.js", "playback_clock.js", "user_controls.js",
)  # fmt: skip
"""The scripts, in order. Each script uses names that earlier scripts define."""


def animate(result: Result, path: str | os.PathLike[str], tell: Callable[[float, float], None] | None = None) -> Path:
    """Write a self-contained page of the run, or a film. The page opens from disk. With ``…html?t=0.5``, the page starts at 0.5 s.

    tell: function that is called with (time of the frame, last time), s, after each frame of a film. SceneError when the result
    lacks positions and orientations, for a suffix not in ``SUFFIXES``, an unwritable folder, or MP4 without the extra ``video``.
    """
    with writing(path, SUFFIXES) as work:
        if work.suffix.lower() in FILMS:
            film(result, work, tell=tell)
        else:
            work.write_text(page(result), encoding="utf-8")
    return Path(path)


def page(result: Result, shown: str = "") -> str:
    """The page as HTML text. shown: options, such as "t=0.5&names=1" (``viewer/README.md``). Options in the page's address override
    these options."""
    return make_html_page(
        VIEWER / "page.html", "style.css", SCRIPTS, result.scene.title or result.scene.name, content(result) | {"shown": shown}
    )
