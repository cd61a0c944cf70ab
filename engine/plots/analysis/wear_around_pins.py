"""Pictures of wear around pins. Each contact has a circle. The wear depths of pin and bearing are drawn outward from the circle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from trunnion.plots.style.palette import COLORS, GRID, INK
from trunnion.plots.style.panels_and_labels import make_panels

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMNS = 4
SWELL = 0.5
"""Distance of the deepest wear from the circle, divided by the circle's radius."""
MICRO = 1e6

Around = tuple[str, np.ndarray, np.ndarray, np.ndarray]
"""Title, directions (rad, from e3 towards e2), depth on the pin and on the bearing, m."""


def draw_wear(contacts: Sequence[Around]) -> Figure:
    """A polar panel for each contact that goes around its pin."""
    fig, panels = make_panels(len(contacts), COLUMNS, (3.4, 3.9), projection="polar")
    for axes, (title, angles, pin, bearing) in zip(panels, contacts, strict=True):
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
