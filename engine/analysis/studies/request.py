"""Requests of studies: converts bounds, goal and constraints to a study and to the plan of its cases."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from math import inf, isfinite
from typing import Any

import numpy as np

from trunnion.analysis.studies.box_refinement import OUTCOME, BoxRefinement
from trunnion.analysis.studies.evolution_strategy import GOALS, Optimisation
from trunnion.analysis.studies.study_rounds import REVISION, Study, study_cases
from trunnion.basics.errors import Problem, SceneError
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.batch.cases.grids_and_samples import ranges
from trunnion.batch.cases.quantity_reader import number_at
from trunnion.batch.plan_and_runner import Plan, Run, check_run
from trunnion.batch.sample_statistics.result_queries import bound
from trunnion.batch.tables.reductions import Reduction, reductions
from trunnion.kernel.interface.output_columns import columns
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.findings.name_suggestions import shown
from trunnion.system.construction.system_builder import build

LEAST, MOST = 16, 5000
"""Least and largest number of cases of a study."""
TOLERANCES = (1e-9, 0.1)
MOST_REFINED = 4
"""Largest number of varied numbers of a refinement: a box of n numbers has 2^n corners."""
OWN_TIME = ("simulation.until", "simulation.every")
Values = Callable[[int, int], np.ndarray]


@dataclass(frozen=True)
class StudyRequest:
    """A study as the user requests it.

    Attributes:
        kind: "optimise" or "refine".
        bounds: {path: (low, high)}.
        goals: only for "optimise": {goal: result}, where goal is one of GOALS; for "reach": {"reach": (result, value)}.
        within: constraints {result: (low, high)}; None means no bound.
        of: only for "refine": a result, or "outcome".
        revision: revision of the search; a stored study keeps its revision.
    """

    kind: str
    bounds: Mapping[str, Any]
    goals: Mapping[str, Any] = field(default_factory=dict)
    within: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    of: str = OUTCOME
    cases: int = 600
    seed: int = 0
    tolerance: float = 1e-3
    revision: int = REVISION


def make_study(
    scene: Scene, wanted: StudyRequest, keep: Sequence[str], run: Run, wrong: Sequence[Problem] = ()
) -> tuple[Study, Plan]:
    """The study, and the plan of its cases. ``with_case_values`` later supplies the parameter values of the cases.

    keep: further reductions; wrong: problems found before. SceneError lists every problem.
    """
    problems = list(wrong)
    units, low, high = ranges(scene, wanted.bounds, problems, f"{wanted.kind}.bounds")
    for path in (p for p in wanted.bounds if p in OWN_TIME):
        problems.append(
            Problem(f"{wanted.kind}.bounds.{path}", "this path is a setting of the run", "vary numbers of the mechanism")
        )
    problems += _setting_problems(wanted)
    needed = _needed_results(wanted, problems)
    chosen = _read_kept(scene, [*needed, *keep], problems)
    try:
        check_run(scene, run)
    except SceneError as e:
        problems += e.problems
    made = _build_study(scene, wanted, (units, low, high), chosen, problems) if not problems else None
    if made is None or problems:
        raise SceneError(problems)

    def unknown(start: int, stop: int) -> np.ndarray:
        raise RuntimeError("the parameter values of these cases follow from earlier results")

    return made, Plan(scene, study_cases(made, unknown), chosen, run)


def with_case_values(made: Study, plan: Plan, values: Values) -> Plan:
    """The plan with ``values`` as the source of its cases' parameter values."""
    return Plan(plan.scene, study_cases(made, values), plan.reductions, plan.run, plan.about)


def _setting_problems(wanted: StudyRequest) -> list[Problem]:
    """Problems of the number of cases, the tolerance, the seed and the number of bounds."""
    problems = []
    if not LEAST <= wanted.cases <= MOST:
        problems.append(Problem(f"{wanted.kind}.cases", f"{wanted.cases} cases", f"from {LEAST} to {MOST}"))
    if not TOLERANCES[0] <= wanted.tolerance <= TOLERANCES[1]:
        told = f"from {TOLERANCES[0]:g} to {TOLERANCES[1]:g} of the ranges"
        problems.append(Problem(f"{wanted.kind}.tolerance", f"{wanted.tolerance:g}", told))
    if wanted.seed < 0:
        problems.append(Problem(f"{wanted.kind}.seed", f"{wanted.seed} is negative", "a whole number from 0"))
    if wanted.kind == "refine" and len(wanted.bounds) > MOST_REFINED:
        what = f"{len(wanted.bounds)} numbers are more than {MOST_REFINED}"
        problems.append(Problem("refine.bounds", what, "set the other numbers to fixed values"))
    return problems


def _needed_results(wanted: StudyRequest, problems: list[Problem]) -> list[str]:
    """Names of the results that the study needs."""
    if wanted.kind == "refine":
        return [] if wanted.of == OUTCOME else [wanted.of]
    if len(wanted.goals) != 1:
        what = "no goal is given" if not wanted.goals else "more than one goal"
        problems.append(Problem("optimise", what, f"exactly one of {', '.join(GOALS)}"))
        return []
    (goal,) = wanted.goals.values()
    return [goal[0] if isinstance(goal, list | tuple) else goal, *wanted.within]


def _read_kept(scene: Scene, texts: Sequence[str], problems: list[Problem]) -> tuple[Reduction, ...]:
    """The reductions that the texts name; the default reductions if there are no texts."""
    try:
        return reductions(list(dict.fromkeys(texts)), columns(build(scene).system))
    except SceneError as e:
        problems += e.problems
        return ()


def _build_study(
    scene: Scene, wanted: StudyRequest, box: Any, chosen: Sequence[Reduction], problems: list[Problem]
) -> Study | None:
    """The study of a request. A wrong request adds to ``problems`` and gives None."""
    units, low, high = box[0], tuple(map(float, box[1])), tuple(map(float, box[2]))
    kept, paths = {r.name: r.unit for r in chosen}, tuple(wanted.bounds)
    for name in (n for n in _needed_results(wanted, problems) if n not in kept):
        problems.append(Problem(wanted.kind, f"{shown(name)} is not a single result", "one column or event, without wild cards"))
    if problems:
        return None
    if wanted.kind == "refine":
        return BoxRefinement(
            paths, units, low, high, wanted.of, most=wanted.cases, tolerance=wanted.tolerance, revision=wanted.revision
        )
    ((goal, given),) = wanted.goals.items()
    of, target = (given, 0.0) if isinstance(given, str) else (given[0], bound(given[1], kept[given[0]], "reach", problems))
    within: list[tuple[str, float, float]] = []
    for name, ends in wanted.within.items():
        least, most = (e if e is not None else end for e, end in zip(ends, (-inf, inf), strict=True))
        pair = [x if x in (-inf, inf) else bound(x, kept[name], f"within.{name}", problems) for x in (least, most)]
        if isfinite(pair[0]) and isfinite(pair[1]) and pair[0] > pair[1]:
            problems.append(Problem(f"within.{name}", f"{ends[0]} is above {ends[1]}", "the low end first"))
        within.append((name, pair[0], pair[1]))
    own = tuple((number_at(scene, p) or (0.5 * (a + b), ""))[0] for p, a, b in zip(paths, low, high, strict=True))
    return Optimisation(
        paths, units, low, high, own, goal, of, target, tuple(within), wanted.seed, most=wanted.cases, tolerance=wanted.tolerance,
        revision=wanted.revision,
    )  # fmt: skip
