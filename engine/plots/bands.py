"""Errors in panels: a band about each curve, and how wide it gets, since most are narrower than a line."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from engine.plots.palette import INK, color
from engine.simulation.certainty.stated import rough

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from engine.plots.panels import Panel

FAINT = 0.25
UNKNOWN = "#f7efe2"
"""Behind curves where nothing is promised."""


def errors(axes: Axes, panel: Panel, scale: float, power: int, until: float) -> None:
    """Draw the bands of a panel's curves. scale: of times; power: of ten, that values are divided by; until: time from which
    nothing is promised, s."""
    largest = 0.0
    for i, c in enumerate(panel.curves):
        if c.error is None:
            continue
        low, high = (c.values - c.error) / 10.0**power, (c.values + c.error) / 10.0**power
        axes.fill_between(c.time * scale, low, high, color=color(i), alpha=FAINT, lw=0)
        largest = max(largest, float(np.nanmax(c.error, initial=0.0)))
    if largest > 0.0:
        text = f"± {rough(largest)} {panel.unit}"
        axes.text(0.995, 0.03, text, transform=axes.transAxes, ha="right", va="bottom", size=7.5, color=INK)
    end = axes.get_xlim()[1]
    if until * scale < end:
        axes.axvspan(until * scale, end, color=UNKNOWN, lw=0, zorder=0)
