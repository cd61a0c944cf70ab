"""The assembled start of a scene, before anything has moved, as a page to turn it on."""

from __future__ import annotations

from engine.plots.animate import page
from engine.plots.mechanism import begun
from engine.scene.model import Scene


def start_page(scene: Scene, shown: str = "", where: str = "scene") -> str:
    """A page by itself that shows the start in three dimensions: bodies, pins, contact places, forces. shown: how it opens
    (``viewer/README.md``). where: what asked, in problems. SceneError when the scene cannot be assembled."""
    return page(begun(scene, where), shown)
