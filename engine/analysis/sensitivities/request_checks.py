"""Checks a request for derivatives and reports all problems together, before anything is built."""

from __future__ import annotations

import math
from collections.abc import Sequence

from trunnion.analysis.sensitivities.initial_data_derivatives import parameter_problems
from trunnion.basics.errors import Problem, raise_problems
from trunnion.kernel.interface.output_columns import Column, columns, needs_quadratures, select
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.queries.unilateral_joints import has_unilateral
from trunnion.simulation.run import pattern_problems
from trunnion.simulation.settings.memory_limits import row_problems
from trunnion.system.construction.system_builder import Built, build

SAMPLES = 100
TOLERANCE = 1e-9
"""Defaults: number of samples, and relative tolerance of the run."""


def check_request(
    scene: Scene, parameters: Sequence[str], outputs: Sequence[str], until: float | None, every: float | None, rtol: float | None,
    built: Built | None = None,
) -> tuple[list[Column], float, float, float]:  # fmt: skip
    """Check a request. Returns its columns, end time (s), spacing of samples (s) and relative tolerance. built: the result of
    ``build``, if it is known. SceneError lists every problem."""
    everything = columns((built or build(scene)).system)
    chosen = select(everything, tuple(outputs))
    problems = [*parameter_problems(scene, parameters), *_column_problems(everything, chosen, outputs)]
    if has_unilateral(scene):
        hint = "choose columns of motion or forces"
        works = [c.name for c in chosen if needs_quadratures([c])]
        problems += [Problem("outputs", f"{n} has no derivative across impacts, where it jumps", hint) for n in works]
    end = float(scene.simulation.until if until is None else until)
    spacing = float(every or end / SAMPLES)
    if not (0 < end < math.inf and 0 < spacing <= end):
        problems.append(Problem("every", f"{spacing:g} s is not a valid spacing for a run of {end:g} s", "0 < every <= until"))
    else:
        problems += row_problems(end, spacing, columns=(1 + len(chosen)) * (1 + len(parameters)))
    raise_problems(problems)
    return chosen, end, spacing, TOLERANCE if rtol is None else rtol


def _column_problems(everything: list[Column], chosen: list[Column], outputs: Sequence[str]) -> list[Problem]:
    if not outputs:
        return [Problem("outputs", "no output is given", "see `trunnion check SCENE --columns` for the names")]
    return pattern_problems(everything, tuple(outputs)) + [
        Problem("outputs", f"{c.name} has no derivative", "choose a column of motion, forces or energies")
        for c in chosen
        if not c.quantity.smooth
    ]
