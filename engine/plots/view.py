"""The moving picture of a run in a notebook: the same page as ``animate`` writes, in a frame of its own."""

from __future__ import annotations

import html
from dataclasses import dataclass

from engine.plots.animate import page
from engine.simulation.result import Result

HEIGHT = 560
"""Pixels."""


@dataclass(frozen=True)
class View:
    """What a notebook displays as the run in motion. text: the page; title: its name for readers of the screen; height, pixels."""

    text: str
    title: str
    height: int

    def _repr_html_(self) -> str:
        """A frame that holds the page: it may run its own scripts, and reach neither the notebook nor anything else."""
        return (
            f'<iframe srcdoc="{html.escape(self.text)}" sandbox="allow-scripts" title="{html.escape(self.title)}" '
            f'style="width:100%;height:{self.height}px;border:1px solid #8885;border-radius:6px"></iframe>'
        )


def view(result: Result, shown: str = "", height: int = HEIGHT) -> View:
    """The run in motion, to end a notebook's cell with. shown: how it opens, such as "t=0.5&names=1&section=view".

    SceneError when the result lacks positions and orientations.
    """
    return View(page(result, shown), f"{result.scene.title or result.scene.name}, moving", height)
