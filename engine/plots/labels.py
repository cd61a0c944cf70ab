"""Names of bodies and joints in a picture of the mechanism, kept apart."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from engine.plots.palette import INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from engine.plots.motion import Motion
    from engine.plots.scenery import Scenery

NEAR = 0.02
"""Part of the picture's width: names closer to each other than that would overlap."""
LINE = 11
"""Points from one line of text to the next."""


def label(axes: Axes, view: np.ndarray, scene: Scenery, moved: Motion, row: int) -> None:
    """Write the names: joints outwards and above their places (one line for all in one place), bodies at their mass centres,
    or below what is already there."""
    from matplotlib.patheffects import withStroke

    left, right = axes.get_xlim()
    near = NEAR * (right - left)
    look: dict[str, Any] = {
        "textcoords": "offset points",
        "zorder": 6,
        "path_effects": [withStroke(linewidth=2, foreground="white", alpha=0.8)],
    }
    joints: list[tuple[np.ndarray, list[str]]] = []
    for j in scene.joints:
        p, r = moved.pose(j.parts[1], row)
        _beside(joints, (view @ (p + r @ j.points[1]))[:2], near).append(j.name)
    for at, names in joints:
        side = 1 if at[0] >= (left + right) / 2 else -1
        words, ha = ", ".join(names), "left" if side > 0 else "right"
        axes.annotate(words, (at[0], at[1]), xytext=(7 * side, 9), ha=ha, size=7, color="#444444", **look)
    bodies: list[tuple[np.ndarray, list[str]]] = []
    for i, part in enumerate(scene.parts):
        _beside(bodies, (view @ moved.pose(i, row)[0])[:2], near).append(part.name)
    for at, names in bodies:
        below = -1.3 * LINE if any(np.linalg.norm(at - other) < near for other, _ in joints) else 0.0
        for k, name in enumerate(names):
            offset = (0.0, below - k * LINE)
            axes.annotate(name, (at[0], at[1]), xytext=offset, size=8, color=INK, ha="center", va="center", **look)


def _beside(places: list[tuple[np.ndarray, list[str]]], at: np.ndarray, near: float) -> list[str]:
    """The list of names at a place; a new one when no place is near."""
    for other, names in places:
        if np.linalg.norm(at - other) < near:
            return names
    places.append((at, []))
    return places[-1][1]
