"""What a run may be asked for: checked in one place, whoever asks (command line, Python, sweeps, the service)."""

from __future__ import annotations

import math
from collections.abc import Sequence

from engine.basics.problems import Problem, SceneError
from engine.friction import REGISTRY as LAWS
from engine.integrators import REGISTRY as METHODS
from engine.integrators import Impulses
from engine.kernel.columns import columns, select
from engine.scene.model import Scene
from engine.simulation import block as bl
from engine.simulation.bounded import problems as bounded
from engine.simulation.memory import NEVER_MANY, expected_rows, row_problems
from engine.simulation.settings import settings_read
from engine.system.build import build


def check_settings(
    until: float, every: float, s: bl.Settings, scene: Scene, outputs: Sequence[str] | None = None, step: float = 0.0
) -> None:
    """Refuse settings of a run that cannot be carried out: SceneError with everything that is wrong with them for this scene.
    until: end time, s; every: output spacing, s; outputs: patterns of the columns kept of every row, None where no row is kept;
    step: a fixed one asked for beside the scene's, s, or 0."""
    asked = {"until": until, "every": every, "rtol": s.rtol, "method": s.method, "step": s.step}
    _, problems = settings_read("engine.simulate", asked)
    laws = {scene.law_of(j.friction) for j in scene.joints.values() if j.friction}
    if 0.0 < until < math.inf and 0.0 <= every < math.inf and 0.0 <= s.step < math.inf:
        problems += row_problems(until, every, s.step, _width(scene, outputs, expected_rows(until, every, s.step)))
    stiff = sorted(law for law in laws if not LAWS[law].steps)
    if s.method in {m.name for m in METHODS if isinstance(m, Impulses)} and stiff:
        able = " or ".join(name for name, law in LAWS.items() if law.steps)
        problems.append(Problem("method", f"{s.method} cannot step law {stiff[0]}", f"use law {able}, or method auto"))
    problems += bounded(scene, s.method, every, step)
    if problems:
        raise SceneError(problems)


def _width(scene: Scene, outputs: Sequence[str] | None, rows: float) -> int:
    """How many numbers a kept row has, its time included; 0 where no row is kept, or where there are too few rows for its width
    to matter."""
    if outputs is None or rows <= NEVER_MANY:
        return 0
    return 1 + len(select(columns(build(scene).system), tuple(outputs)))
