"""``simulate``: a run of a scene."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.units.python_arguments import Amount, Names, names_given
from trunnion.simulation.execution.run_loop import OneRun, Progress
from trunnion.simulation.execution.runnable_model import Model, pattern_problems
from trunnion.simulation.results.outcome import CANCELLED
from trunnion.simulation.results.result import Result
from trunnion.simulation.runtime_interface import simulation_block as bl
from trunnion.simulation.settings.realtime_steps import bounds_of
from trunnion.simulation.settings.request_checks import check_settings
from trunnion.simulation.settings.run_settings import Run, settings_given, with_setting_docs

if TYPE_CHECKING:
    from trunnion.scene.overrides import Given

__all__ = ["Model", "pattern_problems", "run", "run_checked", "simulate"]
ASKED = ("until", "every", "rtol", "method", "step", "kernel", "max_steps")
"""Settings of a run."""


@with_setting_docs("trunnion.simulate")
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
    max_steps: Amount | None = None,
    progress: Progress | None = None,
    certify: bool = False,
    accuracy: Amount | None = None,
) -> Result:
    """Run a scene.

    A run that fails returns a Result with the rows and events so far and a named outcome. A run that Ctrl-C ends returns such a
    Result with the outcome ``cancelled``. Ctrl-C before the first row raises KeyboardInterrupt.

    Args:
        scene: a Scene, a file, the name of a bundled model, or a dict with the content of a scene file.
        overrides: changes of the scene, {"joints.ball.friction.mu": 0.5, …}.
        outputs: a pattern of columns, or several.
        progress: progress(time, until), s, called a few times a second.
        certify: whether the result has a ``certainty``: the global error of every value, estimated by a second, tighter run. Both
            runs together cost 2.5 times as much as one run.
        accuracy: bound of the errors, such as 1e-6 or "1e-6 N", from which the tolerance follows. A bound with a unit applies to
            all columns in that unit; a bound without a unit applies to positions and angles.

    Raises:
        SceneError: for wrong input.
    """
    from trunnion.scene.overrides import scene_given  # imported here, because ``run_checked`` does not need this module

    asked = {"until": until, "every": every, "rtol": rtol, "method": method, "step": step, "kernel": kernel, "max_steps": max_steps}
    return run_checked(scene_given(scene, overrides), asked, outputs, progress, certify, accuracy)


def run_checked(
    loaded: Scene,
    asked: Mapping[str, Any],
    outputs: Names | None = None,
    progress: Progress | None = None,
    certify: bool = False,
    accuracy: Amount | None = None,
) -> Result:
    """``simulate`` for a checked scene. asked: settings of the run by name; the other settings have their defaults."""
    chosen = settings_given("trunnion.simulate", dict.fromkeys(ASKED) | dict(asked))
    fixed = chosen.pop("step") or 0.0
    own = Run(**chosen)
    end, spacing, tolerance = own.of(loaded)
    jams = loaded.simulation.jams == "impact"
    steps: dict[str, Any] = {"step": fixed} | bounds_of(loaded)
    settings = bl.Settings(tolerance, own.method_of(loaded), max_steps=int(own.max_steps or 0), through_jams=jams, **steps)
    patterns = names_given(loaded.outputs if outputs is None else outputs)
    check_settings(end, spacing, settings, loaded, patterns, fixed)
    if certify or accuracy is not None:
        from trunnion.simulation.global_error.tolerance_search import ErrorRequest, run_with_error

        request = ErrorRequest(end, spacing, settings, accuracy, asked.get("rtol") is not None)
        return run_with_error(loaded, patterns, own.kernel, request, progress)
    return OneRun(Model(loaded, patterns, own.kernel), end, spacing, settings, progress).result()


def run(model: Model, until: float, every: float, settings: bl.Settings, progress: Progress | None = None) -> Result:
    """Execute a run as a part of larger work. until, every: s. A run that fails returns a Result, too.

    Ctrl-C raises KeyboardInterrupt, because the user wants to end the whole work."""
    result = OneRun(model, until, every, settings, progress).result()
    if result.outcome.name == CANCELLED:
        raise KeyboardInterrupt
    return result
