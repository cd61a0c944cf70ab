"""Settings of a bundled model's pictures: the instant to show, and the curves."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from trunnion.plots.geometry.motion_and_view import VIEW


@dataclass(frozen=True)
class Plot:
    """A panel of columns with one common unit. degrees: whether angles are shown in degrees."""

    title: str
    quantity: str
    columns: tuple[str, ...]
    degrees: bool = False


@dataclass(frozen=True)
class Choice:
    """Settings of the pictures of a model.

    at: instant of the mechanism's picture, s. says: the line above the curves. curves: panels, each the title of a panel of
    ``figure`` or a ``Plot``. until, every: end and row spacing of the run, s (None: those of the scene). around: time span of the
    run whose extent determines the view, s. aside: position of the viewer (as in ``mechanism``). changes: overrides of the scene.
    """

    at: float
    says: str
    curves: tuple[str | Plot, ...]
    until: float | None = None
    every: float | None = None
    around: tuple[float, float] | None = None
    aside: tuple[float, float] = VIEW
    changes: dict[str, Any] = field(default_factory=dict)
