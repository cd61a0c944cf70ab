"""Shapes of a mechanism over each other: where it rests, and how far a mode takes it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from engine.plots.mechanism import VIEW, draw_bodies, frame_of, needed
from engine.plots.motion import bounds, first_view, motion
from engine.plots.scenery import scenery
from engine.scene.model import Scene
from engine.simulation.result import Result
from engine.simulation.run import simulate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INSTANT = 1e-9
"""s; a run of that length is a pose."""
COLUMNS = 4
FAINT = 0.25


def shapes(rest: Scene, away: Sequence[tuple[str, Scene, Scene]]) -> Figure:
    """A panel for each (title, one extreme, the other): the pose of rest, and faintly both extremes."""
    from matplotlib.figure import Figure

    count = max(len(away), 1)
    columns = min(COLUMNS, count)
    rows = -(-count // columns)
    fig = Figure(figsize=(3.2 * columns, 3.2 * rows), facecolor="white", layout="constrained")
    for i, (title, *extremes) in enumerate(away):
        axes = fig.add_subplot(rows, columns, i + 1)
        axes.axis("off")
        axes.set_title(title, fontsize=9)
        runs = [(_pose(scene), alpha) for scene, alpha in ((rest, 1.0), *((scene, FAINT) for scene in extremes))]
        drawn = scenery(rest)
        moved = [motion(r, [p.name for p in drawn.parts]) for r, _ in runs]
        view = first_view(drawn.up, *bounds(drawn, moved[1]), VIEW)
        seen = [draw_bodies(axes, view, drawn, m, 0, alpha) for m, (_, alpha) in zip(moved, runs, strict=True)]
        frame_of(axes, np.concatenate(seen), 1.0)
    return fig


def _pose(scene: Scene) -> Result:
    return simulate(scene, until=INSTANT, every=INSTANT, outputs=needed(scene))
