"""Settings of a bundled model's pictures: the instant to show, and the curves."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from trunnion.plots.geometry.motion_and_view import VIEW


@dataclass(frozen=True)
class Plot:
    """A panel of columns that share one unit. degrees: whether angles are shown in degrees."""

    title: str
    quantity: str
    columns: tuple[str, ...]
    degrees: bool = False


@dataclass(frozen=True)
class Choice:
    """What to draw of a model.

    at: instant of the mechanism's picture, s. says: the line above the curves. curves: panels, by the titles they have in
    ``figure``, or of one's own. until, every: of the run (none: the scene's). around: the part of it whose extent decides
    from where the mechanism is seen, s. aside: where the viewer stands (see ``mechanism``). changes: overrides of the scene.
    """

    at: float
    says: str
    curves: tuple[str | Plot, ...]
    until: float | None = None
    every: float | None = None
    around: tuple[float, float] | None = None
    aside: tuple[float, float] = VIEW
    changes: dict[str, Any] = field(default_factory=dict)
