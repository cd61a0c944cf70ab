"""Wear around pins: a circle for each contact, what comes off pin and bearing drawn outward from it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from engine.plots.palette import COLORS, GRID, INK

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMNS = 4
SWELL = 0.5
"""Of the circle's radius: how far out the deepest wear is drawn."""
MICRO = 1e6

Around = tuple[str, np.ndarray, np.ndarray, np.ndarray]
"""Title, directions (rad, from e3 towards e2), depth on the pin and on the bearing, m."""


def worn(contacts: Sequence[Around]) -> Figure:
    """A polar panel for each contact that goes around its pin."""
    from matplotlib.figure import Figure

    count = max(1, len(contacts))
    columns = min(COLUMNS, count)
    rows = -(-count // columns)
    fig = Figure(figsize=(3.4 * columns, 3.9 * rows), facecolor="white", layout="constrained")
    for i, (title, angles, pin, bearing) in enumerate(contacts):
        axes = fig.add_subplot(rows, columns, i + 1, projection="polar")
        deepest = max(float(pin.max(initial=0.0)), float(bearing.max(initial=0.0)), 1e-300)
        closed = np.append(angles, angles[0])
        axes.plot(np.linspace(0, 2 * np.pi, 200), np.ones(200), color=INK, linewidth=0.8)
        for depth, color, word in ((pin, COLORS[0], "pin"), (bearing, COLORS[1], "bearing")):
            out = 1.0 + SWELL * np.append(depth, depth[0]) / deepest
            axes.plot(closed, out, color=color, linewidth=1.4, label=f"{word}, at most {MICRO * depth.max():.3g} µm")
            axes.fill_between(closed, 1.0, out, color=color, alpha=0.25)
        axes.set_ylim(0.0, 1.0 + 1.15 * SWELL)
        axes.set_yticks([])
        axes.grid(color=GRID)
        axes.set_title(title, fontsize=9)
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.06), fontsize=7, frameon=False)
    return fig
