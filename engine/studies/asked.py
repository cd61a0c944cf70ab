"""What is asked of a study, understood: bounds, goal and constraints as written become one that can be followed, and its plan."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf, isfinite
from typing import Any

import numpy as np

from engine.basics.problems import Problem, SceneError
from engine.batch.answers import bound
from engine.batch.cases import ranges
from engine.batch.plan import Plan, Run, check_run
from engine.batch.reductions import Reduction, reductions
from engine.batch.written import number_at
from engine.kernel.columns import columns
from engine.scene.model import Scene
from engine.scene.suggest import shown
from engine.studies.following import Study, cases_of
from engine.studies.optimum import GOALS, Optimum
from engine.studies.refined import OUTCOME, Refined
from engine.system.build import build

LEAST, MOST = 16, 5000
"""Cases that a study may be given."""
TOLERANCES = (1e-9, 0.1)
MOST_REFINED = 4
"""Numbers over which can be refined: a box has 2^n corners."""
OWN_TIME = ("simulation.until", "simulation.every")
Values = Callable[[int, int], np.ndarray]


@dataclass(frozen=True)
class Wanted:
    """A study as written. bounds: {path: (low, high)}; for the best numbers ``goal``: one of GOALS with a result, and for "reach" a
    value; within: {result: (low or None, high or None)}; for refining ``of``: a result, or "outcome"."""

    kind: str
    bounds: Mapping[str, Any]
    goals: Mapping[str, Any] = field(default_factory=dict)
    within: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    of: str = OUTCOME
    cases: int = 600
    seed: int = 0
    tolerance: float = 1e-3


def study_of(scene: Scene, wanted: Wanted, keep: Sequence[str], run: Run, wrong: Sequence[Problem] = ()) -> tuple[Study, Plan]:
    """The study and the plan of its cases, whose numbers are not known yet (``with_values``). keep: reductions to keep besides.
    SceneError with everything that is wrong."""
    problems = list(wrong)
    units, low, high = ranges(scene, wanted.bounds, problems, f"{wanted.kind}.bounds")
    for path in (p for p in wanted.bounds if p in OWN_TIME):
        problems.append(Problem(f"{wanted.kind}.bounds.{path}", "it is a setting of the run", "vary numbers of the mechanism"))
    problems += _settings(wanted)
    needed = _needed(wanted, problems)
    chosen = _kept(scene, [*needed, *keep], problems)
    try:
        check_run(scene, run)
    except SceneError as e:
        problems += e.problems
    made = _made(scene, wanted, (units, low, high), chosen, problems) if not problems else None
    if made is None or problems:
        raise SceneError(problems)

    def unknown(start: int, stop: int) -> np.ndarray:
        raise RuntimeError("the numbers of these cases follow from results")

    return made, Plan(scene, cases_of(made, unknown), chosen, run)


def with_values(made: Study, plan: Plan, values: Values) -> Plan:
    """The plan with the numbers of its cases."""
    return Plan(plan.scene, cases_of(made, values), plan.reductions, plan.run, plan.about)


def _settings(wanted: Wanted) -> list[Problem]:
    """What is wrong with its numbers."""
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
        problems.append(Problem("refine.bounds", what, "give the others values"))
    return problems


def _needed(wanted: Wanted, problems: list[Problem]) -> list[str]:
    """The results it needs."""
    if wanted.kind == "refine":
        return [] if wanted.of == OUTCOME else [wanted.of]
    if len(wanted.goals) != 1:
        what = "no goal is given" if not wanted.goals else "more than one goal"
        problems.append(Problem("optimise", what, f"exactly one of {', '.join(GOALS)}"))
        return []
    (goal,) = wanted.goals.values()
    return [goal[0] if isinstance(goal, list | tuple) else goal, *wanted.within]


def _kept(scene: Scene, texts: Sequence[str], problems: list[Problem]) -> tuple[Reduction, ...]:
    """The reductions kept; for none, those usually kept."""
    try:
        return reductions(list(dict.fromkeys(texts)), columns(build(scene).system))
    except SceneError as e:
        problems += e.problems
        return ()


def _made(scene: Scene, wanted: Wanted, box: Any, chosen: Sequence[Reduction], problems: list[Problem]) -> Study | None:
    """The study of what was written rightly so far."""
    units, low, high = box[0], tuple(map(float, box[1])), tuple(map(float, box[2]))
    kept, paths = {r.name: r.unit for r in chosen}, tuple(wanted.bounds)
    for name in (n for n in _needed(wanted, problems) if n not in kept):
        problems.append(Problem(wanted.kind, f"{shown(name)} is no single result", "one column or event, without wild cards"))
    if problems:
        return None
    if wanted.kind == "refine":
        return Refined(paths, units, low, high, wanted.of, wanted.cases, wanted.tolerance)
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
    return Optimum(paths, units, low, high, own, goal, of, target, tuple(within), wanted.cases, wanted.seed, wanted.tolerance)
