"""``simulate``: a scene in, a Result out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from engine.scene.given import Amount, Names, names_given
from engine.scene.overrides import Given, scene_given
from engine.simulation import block as bl
from engine.simulation.asked import check_settings
from engine.simulation.bounded import bounds_of
from engine.simulation.certainty.asked import Wanted, stated
from engine.simulation.model import Model, pattern_problems
from engine.simulation.result import Result
from engine.simulation.settings import Run, described, settings_given
from engine.simulation.stepping import OneRun, Progress

__all__ = ["Model", "pattern_problems", "run", "simulate"]


@described("engine.simulate")
def simulate(
    scene: Given,
    until: Amount | None = None,
    every: Amount | None = None,
    rtol: Amount | None = None,
    method: str | None = None,
    kernel: str | None = None,
    overrides: Mapping[str, Any] | None = None,
    outputs: Names | None = None,
    step: Amount | None = None,
    max_steps: int = 0,
    progress: Progress | None = None,
    certify: bool = False,
    accuracy: Amount | None = None,
) -> Result:
    """Run a scene.

    scene: a Scene, a file, a bundled model's name, or a dict as it would stand in a file. overrides:
    {"joints.ball.friction.mu": 0.5, …}. outputs: a pattern of columns, or several. rtol is absolute too, in the scene's own scales.
    max_steps: give up after so many (0: never). certify: the result has a ``certainty``, the global error of every number, from
    a second, tighter run (2.5 times the work). accuracy: 1e-6 or "1e-6 N": the tolerance is chosen so that the stated errors of
    all columns in that unit (of a number: of positions and angles of the motion) are below it. Raises SceneError for wrong
    input; a run that cannot go on returns a Result with what it has and a named outcome. Ctrl-C while it steps does the same:
    every row and event up to then, outcome ``stopped``; a script that should end with it raises KeyboardInterrupt when it finds
    that outcome. Before the first row, while the kernel is built, there is nothing to keep, and KeyboardInterrupt is raised.
    """
    loaded = scene_given(scene, overrides)
    asked = {"until": until, "every": every, "rtol": rtol, "method": method, "step": step, "kernel": kernel}
    chosen = settings_given("engine.simulate", asked)
    fixed = chosen.pop("step") or 0.0
    own = Run(**chosen)
    end, spacing, tolerance = own.of(loaded)
    jams = loaded.simulation.jams == "impact"
    steps: dict[str, Any] = {"step": fixed} | bounds_of(loaded)
    settings = bl.Settings(tolerance, own.method_of(loaded), max_steps=max_steps, through_jams=jams, **steps)
    patterns = names_given(loaded.outputs if outputs is None else outputs)
    check_settings(end, spacing, settings, loaded, patterns, fixed)
    if certify or accuracy is not None:
        return stated(loaded, patterns, own.kernel, Wanted(end, spacing, settings, accuracy, rtol is not None), progress)
    return OneRun(Model(loaded, patterns, own.kernel), end, spacing, settings, progress).result()


def run(model: Model, until: float, every: float, settings: bl.Settings, progress: Progress | None = None) -> Result:
    """Carry out one run as part of larger work: assemble, start, step to the end; on a failure everything up to it is kept.
    When Ctrl-C stops it, KeyboardInterrupt is raised, because the interrupt is meant for the whole work."""
    result = OneRun(model, until, every, settings, progress).result()
    if result.outcome.name == "stopped":
        raise KeyboardInterrupt
    return result
