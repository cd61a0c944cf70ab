"""What may be asked of a derivative: every mistake in it at once, before anything is built."""

from __future__ import annotations

import math
from collections.abc import Sequence

from engine.basics.problems import Problem, SceneError
from engine.kernel.columns import Column, columns, select
from engine.scene.model import Scene
from engine.sensitivities.start import parameter_problems
from engine.simulation.memory import row_problems
from engine.simulation.run import pattern_problems
from engine.system.build import build

SAMPLES = 100
TOLERANCE = 1e-9
"""Samples, and relative tolerance of the run underneath, where none are asked for."""


def checked_request(
    scene: Scene, parameters: Sequence[str], outputs: Sequence[str], until: float | None, every: float | None, rtol: float | None
) -> tuple[list[Column], float, float, float]:
    """(columns, end time, s, spacing of samples, s, tolerance) that a derivative is asked for. SceneError with everything that is
    wrong."""
    everything = columns(build(scene).system)
    chosen = select(everything, tuple(outputs))
    problems = [*parameter_problems(scene, parameters), *_columns(everything, chosen, outputs)]
    end = float(scene.simulation.until if until is None else until)
    spacing = float(every or end / SAMPLES)
    if not (0 < end < math.inf and 0 < spacing <= end):
        problems.append(Problem("every", f"{spacing:g} s is no spacing within {end:g} s", "0 < every <= until"))
    else:
        problems += row_problems(end, spacing, columns=(1 + len(chosen)) * (1 + len(parameters)))
    if problems:
        raise SceneError(problems)
    return chosen, end, spacing, TOLERANCE if rtol is None else rtol


def _columns(everything: list[Column], chosen: list[Column], outputs: Sequence[str]) -> list[Problem]:
    if not outputs:
        return [Problem("outputs", "none is given", "see `trunnion check SCENE --outputs` for the names")]
    return pattern_problems(everything, tuple(outputs)) + [
        Problem("outputs", f"{c.name} has no derivative", "it counts or audits; ask for motion, forces or energies")
        for c in chosen
        if not c.quantity.smooth
    ]
