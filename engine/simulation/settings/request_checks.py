"""Checks of the settings of a run, which the command line, Python functions, sweeps and the service share."""

from __future__ import annotations

import math
from collections.abc import Sequence

from trunnion.basics.errors import Problem, raise_problems
from trunnion.kernel.interface.output_columns import columns, select
from trunnion.runtime.integrators import REGISTRY as METHODS
from trunnion.runtime.integrators import Impulses
from trunnion.scene.data_classes.scene import Scene
from trunnion.simulation.runtime_interface import simulation_block as bl
from trunnion.simulation.settings.memory_limits import NEVER_MANY, expected_rows, row_problems
from trunnion.simulation.settings.realtime_steps import STEPPED, stiff_laws
from trunnion.simulation.settings.realtime_steps import step_problems as bounded
from trunnion.simulation.settings.run_settings import settings_read
from trunnion.system.construction.system_builder import build


def check_settings(
    until: float, every: float, s: bl.Settings, scene: Scene, outputs: Sequence[str] | None = None, step: float = 0.0
) -> None:
    """Raise SceneError with every problem of a run's settings for this scene.

    until: end time, s. every: output spacing, s. outputs: patterns of the stored columns; None if rows are not stored. step:
    requested fixed step, s, or 0."""
    asked = {"until": until, "every": every, "rtol": s.rtol, "method": s.method, "step": s.step}
    _, problems = settings_read("trunnion.simulate", asked)
    if 0.0 < until < math.inf and 0.0 <= every < math.inf and 0.0 <= s.step < math.inf:
        problems += row_problems(until, every, s.step, _width(scene, outputs, expected_rows(until, every, s.step)))
    if stiff := unsuitable_laws(scene, s.method):
        what = f"{s.method} cannot integrate the friction law {stiff[0]}"
        problems.append(Problem("method", what, f"use law {STEPPED}, or method auto"))
    problems += bounded(scene, s.method, every, step)
    raise_problems(problems)


def unsuitable_laws(scene: Scene, method: str) -> list[str]:
    """The friction laws of the scene that the method cannot integrate."""
    return stiff_laws(scene) if method in {m.name for m in METHODS if isinstance(m, Impulses)} else []


def _width(scene: Scene, outputs: Sequence[str] | None, rows: float) -> int:
    """Number of values stored for each row, including time. The result is 0 if rows are not stored, or are so few that memory does
    not matter."""
    if outputs is None or rows <= NEVER_MANY:
        return 0
    return 1 + len(select(columns(build(scene).system), tuple(outputs)))
