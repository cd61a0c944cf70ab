"""Mode shapes of a mechanism. One picture shows the pose of rest and both extremes of a mode."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from trunnion.plots.geometry.mechanism_geometry import scenery
from trunnion.plots.geometry.motion_and_view import bounds, first_view, motion
from trunnion.plots.mechanism_pictures.instant_picture import VIEW, draw_bodies, needed, set_limits
from trunnion.plots.style.panels_and_labels import make_panels
from trunnion.scene.data_classes.scene import Scene
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INSTANT = 1e-9
"""Duration of a run that stands for a pose, s."""
COLUMNS = 4
FAINT = 0.25


def draw_mode_shapes(rest: Scene, away: Sequence[tuple[str, Scene, Scene]]) -> Figure:
    """Draw a panel for each (title, one extreme, the other extreme). A panel shows the pose of rest and, in faint colours, both
    extremes."""
    fig, panels = make_panels(len(away), COLUMNS, (3.2, 3.2))
    for axes, (title, *extremes) in zip(panels, away, strict=True):
        axes.axis("off")
        axes.set_title(title, fontsize=9)
        runs = [(_pose(scene), alpha) for scene, alpha in ((rest, 1.0), *((scene, FAINT) for scene in extremes))]
        drawn = scenery(rest)
        moved = [motion(r, [p.name for p in drawn.parts]) for r, _ in runs]
        view = first_view(drawn.up, *bounds(drawn, moved[1]), VIEW)
        seen = [draw_bodies(axes, view, drawn, m, 0, alpha) for m, (_, alpha) in zip(moved, runs, strict=True)]
        set_limits(axes, np.concatenate(seen), 1.0)
    return fig


def _pose(scene: Scene) -> Result:
    return simulate(scene, until=INSTANT, every=INSTANT, outputs=needed(scene))
