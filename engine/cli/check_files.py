"""Files that ``trunnion check`` writes: a picture of the assembled start, and the scene as a whole."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from engine.scene.model import Scene

SCENES = (".yaml", ".yml")


@dataclass(frozen=True)
class Files:
    """What is to be written: a picture of the assembled start, the scene as it is after includes, assemblies and copies."""

    plot: str | None = None
    whole: str | None = None


def write(scene: Scene, plot: Path | None, whole: Path | None) -> list[str]:
    """Write the picture of the assembled start and the whole scene, where they are asked for; the names of what was written.
    SceneError when there is no start to draw."""
    from engine.basics.files import writing
    from engine.scene.dump import scene_to_yaml

    if whole is not None:
        with writing(whole, SCENES) as work:
            work.write_text(scene_to_yaml(scene), encoding="utf-8")
    if plot is not None:
        from engine.plots import save_figure
        from engine.plots.mechanism import at_start

        save_figure(at_start(scene), plot)
    return [str(p) for p in (whole, plot) if p is not None]
