"""Checks of the settings of a run, which the command line, Python functions, sweeps and the service share."""

from __future__ import annotations

import math
from collections.abc import Sequence

from trunnion.basics.errors import Problem, raise_problems
from trunnion.kernel.interface.output_columns import columns, select
from trunnion.runtime.integrators import REGISTRY as METHODS
from trunnion.runtime.integrators import Impulses
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.queries.unilateral_joints import LOCATED, NOT_LOCATED, has_unilateral
from trunnion.simulation.runtime_interface import simulation_block as bl
from trunnion.simulation.settings.memory_limits import NEVER_MANY, expected_rows, row_problems
from trunnion.simulation.settings.realtime_steps import STEPPED, stiff_laws
from trunnion.simulation.settings.realtime_steps import step_problems as bounded
from trunnion.simulation.settings.run_settings import settings_read
from trunnion.system.construction.system_builder import build

TIME_STEPPING = frozenset(m.name for m in METHODS if isinstance(m, Impulses))


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
    problems += method_problems(scene, s.method)
    problems += bounded(scene, s.method, every, step)
    raise_problems(problems)


def method_problems(scene: Scene, method: str) -> list[Problem]:
    """A problem for each part of the scene that the method cannot integrate."""
    if method not in TIME_STEPPING:
        return []
    laws = [f"{method} cannot integrate the friction law {law}" for law in stiff_laws(scene)[:1]]
    problems = [Problem("method", what, f"use law {STEPPED}, or method auto") for what in laws]
    return problems + ([Problem("method", NOT_LOCATED, LOCATED)] if has_unilateral(scene) else [])


def _width(scene: Scene, outputs: Sequence[str] | None, rows: float) -> int:
    """Number of values stored for each row, including time. The result is 0 if rows are not stored, or are so few that memory does
    not matter."""
    if outputs is None or rows <= NEVER_MANY:
        return 0
    return 1 + len(select(columns(build(scene).system), tuple(outputs)))
