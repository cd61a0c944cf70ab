"""Animation of a run in a notebook: the page of ``animate`` in a frame."""

from __future__ import annotations

import html

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.plots.animation.html_or_film import page
from trunnion.simulation.results.result import Result

HEIGHT = 560
"""Default height of the animation, pixels."""


@dataclass(frozen=True)
class View:
    """The animation as a notebook displays it. text: the page. title: name for screen readers. height: pixels."""

    text: str
    title: str
    height: int

    def _repr_html_(self) -> str:
        """An HTML frame with the page. The page may run its own scripts, but cannot reach the notebook or the network."""
        return (
            f'<iframe srcdoc="{html.escape(self.text)}" sandbox="allow-scripts" title="{html.escape(self.title)}" '
            f'style="width:100%;height:{self.height}px;border:1px solid #8885;border-radius:6px"></iframe>'
        )


def view(result: Result, shown: str = "", height: int = HEIGHT) -> View:
    """The animation of a run, for the end of a notebook's cell. shown: options, such as "t=0.5&names=1&section=view".

    SceneError when the result lacks positions and orientations.
    """
    return View(page(result, shown), f"{result.scene.title or result.scene.name}, animation", height)
