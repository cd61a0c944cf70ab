"""Errors in panels, drawn as a band about each curve. Most bands are narrower than a line, so the largest error is also written as
a number."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from trunnion.plots.style.palette import INK, color
from trunnion.simulation.results.error_statement import rough

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from trunnion.plots.curves.panel_selection import Panel

FAINT = 0.25
UNKNOWN = "#f7efe2"
"""Background colour of the time range for which no error is stated."""


def errors(axes: Axes, panel: Panel, scale: float, power: int, until: float) -> None:
    """Draw the bands of a panel's curves.

    scale: times are multiplied by this factor. power: values are divided by this power of ten. until: time from which on no error
    is stated, s.
    """
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
