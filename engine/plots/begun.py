"""The assembled start of a scene, before anything has moved: what a picture of it is drawn from, and a page to turn it on."""

from __future__ import annotations

from dataclasses import replace

from engine.basics.problems import Problem, SceneError
from engine.plots.animate import page
from engine.plots.mechanism import SOONEST, needed
from engine.scene.model import Scene
from engine.simulation.result import Result
from engine.simulation.run import simulate
from engine.simulation.summary import started


def begun(scene: Scene, where: str) -> Result:
    """The row at the start, with all that pictures draw from. where: what asked, in problems. SceneError when the scene cannot be
    assembled."""
    soon = SOONEST * float(scene.simulation.until)
    result = simulate(scene, until=soon, every=soon, outputs=needed(scene))
    if not started(result):
        raise SceneError([Problem(where, f"there is no start to draw: {result.outcome.name}", result.outcome.advice)])
    return replace(result, data=result.data[:1], events=())


def start_page(scene: Scene, shown: str = "", where: str = "scene") -> str:
    """A page by itself that shows the start in three dimensions: bodies, pins, contact places, forces. shown: how it opens
    (``viewer/README.md``). SceneError when the scene cannot be assembled."""
    return page(begun(scene, where), shown)
