"""``optimise`` and ``refine``: studies that run in rounds on this machine's cores."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trunnion.analysis.studies.request import StudyRequest, make_study, with_case_values
from trunnion.analysis.studies.study_rounds import Study, StudyProgress, results_of
from trunnion.basics.interrupts import Unwanted, held, watched
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.basics.optional_packages import brought
from trunnion.batch.plan_and_runner import Plan, Run, Runner, Stopped
from trunnion.batch.sweep import Sweep
from trunnion.scene.overrides import Given, scene_given
from trunnion.scene.units.python_arguments import Amount, Names, names_given
from trunnion.simulation.settings.run_settings import settings_read, with_setting_docs

if TYPE_CHECKING:
    import pyarrow

Progress = Callable[[int, int], None]
"""progress(number of finished cases, largest number of cases), called after each round."""


@dataclass(frozen=True)
class StudyResult:
    """The result of a study.

    Attributes:
        answer: answer of the study as plain data, numbers in SI units.
        sweep: all cases of the study, in the order of the rounds.
    """

    answer: dict[str, Any]
    sweep: Sweep

    def __repr__(self) -> str:
        return f"<{self.answer['kind']} of {self.sweep.plan.scene.name}: {self.answer['cases']} cases, {self.answer['why']}>"

    @property
    def best(self) -> dict[str, float]:
        """The best numbers of an optimisation, {path: SI value}. They can be given as ``overrides``."""
        return {n["path"]: n["value"] for n in self.answer.get("numbers", ())}

    @property
    def boundaries(self) -> list[dict[str, Any]]:
        """Boxes of a refinement in which outcomes change or the result jumps; ``low`` and ``high`` in SI units."""
        return list(self.answer.get("boundaries", ()))

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the table of all cases to a file (``Sweep.save``)."""
        return self.sweep.save(path)


@with_setting_docs("trunnion.sweep")
def optimise(
    scene: Given,
    bounds: Mapping[str, Sequence[Any]],
    *,
    minimise: str | None = None,
    maximise: str | None = None,
    reach: Sequence[Any] | None = None,
    within: Mapping[str, Sequence[Any]] | None = None,
    cases: int = 600,
    seed: int = 0,
    tolerance: float = 1e-3,
    reductions: Names = (),
    overrides: Mapping[str, Any] | None = None,
    until: Amount | None = None,
    every: Amount | None = None,
    rtol: Amount | None = None,
    method: str | None = None,
    kernel: str | None = None,
    cpu_limit: Amount | None = None,
    max_steps: Amount | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> StudyResult:
    """Find the numbers of a scene that minimise a result, maximise it, or bring it to a target.

    Give exactly one of ``minimise``, ``maximise`` and ``reach``. Failed cases rank last. Equal seeds give equal cases. After
    Ctrl-C the result holds the cases that finished before.

    Args:
        scene: as for ``simulate``.
        bounds: ranges of the numbers, {path: (low, high)}.
        minimise: a reduction, such as "max:ball.contact[1].normal_force".
        maximise: a reduction.
        reach: a reduction and its target value.
        within: constraints, {reduction: (low, high)}; None means no bound.
        cases: largest number of cases.
        seed: seed of the random numbers, a whole number from 0.
        tolerance: the search ends when its spread, relative to the ranges of the numbers, is below this value.
        reductions: further reductions to add to the table of cases.
        overrides: changes of the scene for all cases, {path: value}.
        workers: number of threads; default: one thread per core.
        progress: called with (finished cases, largest number of cases) after each round.

    Returns:
        The best numbers and all cases.

    Raises:
        SceneError: for wrong input.
    """
    goals = {n: g for n, g in (("minimise", minimise), ("maximise", maximise), ("reach", reach)) if g is not None}
    wanted = StudyRequest("optimise", bounds, goals, within or {}, cases=cases, seed=seed, tolerance=tolerance)
    settings = {"until": until, "every": every, "rtol": rtol, "method": method, "kernel": kernel}
    settings |= {"cpu_limit": cpu_limit, "max_steps": max_steps}
    return _run_request(scene, wanted, names_given(reductions), overrides, settings, workers, progress)


@with_setting_docs("trunnion.sweep")
def refine(
    scene: Given,
    bounds: Mapping[str, Sequence[Any]],
    *,
    of: str = "outcome",
    cases: int = 200,
    tolerance: float = 1e-3,
    reductions: Names = (),
    overrides: Mapping[str, Any] | None = None,
    until: Amount | None = None,
    every: Amount | None = None,
    rtol: Amount | None = None,
    method: str | None = None,
    kernel: str | None = None,
    cpu_limit: Amount | None = None,
    max_steps: Amount | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> StudyResult:
    """Vary up to four numbers of a scene, and find where a result jumps or has a kink, or where the outcome changes.

    Cases are added at such places until the result is nearly linear between neighbouring cases, or until the boxes between
    cases are narrower than ``tolerance``.

    Args:
        scene: as for ``simulate``.
        bounds: ranges of the numbers, {path: (low, high)}.
        of: a reduction, or "outcome" for changes of outcome alone.
        cases: largest number of cases.
        tolerance: least width of a box, relative to the ranges.
        reductions: further reductions to add to the table of cases.
        overrides: changes of the scene for all cases, {path: value}.
        workers: number of threads; default: one thread per core.
        progress: called with (finished cases, largest number of cases) after each round.

    Returns:
        The boundaries and all cases.

    Raises:
        SceneError: for wrong input.
    """
    wanted = StudyRequest("refine", bounds, of=of, cases=cases, tolerance=tolerance)
    settings = {"until": until, "every": every, "rtol": rtol, "method": method, "kernel": kernel}
    settings |= {"cpu_limit": cpu_limit, "max_steps": max_steps}
    return _run_request(scene, wanted, names_given(reductions), overrides, settings, workers, progress)


def _run_request(
    scene: Given, wanted: StudyRequest, keep: Sequence[str], overrides: Mapping[str, Any] | None, settings: dict[str, Any],
    workers: int | None, progress: Progress | None,
) -> StudyResult:  # fmt: skip
    loaded = scene_given(scene, overrides)
    values, wrong = settings_read("trunnion.sweep", settings)
    study, plan = make_study(loaded, wanted, keep, Run(**values), wrong)
    return run_study(study, plan, workers, progress)


def run_study(study: Study, plan: Plan, workers: int | None = None, progress: Progress | None = None) -> StudyResult:
    """Run a study on threads. Raises KeyboardInterrupt if Ctrl-C comes before the end of the first round."""
    import pyarrow as pa

    brought("pyarrow", "tables", "a table of cases")
    follow, began = StudyProgress(study), time.perf_counter()
    plan = with_case_values(study, plan, follow.rows)
    threads = max(1, workers or os.cpu_count() or 1)
    runners, tables = [Runner(plan) for _ in range(threads)], list[Any]()
    cancelled = False
    with held() as interrupt, ThreadPoolExecutor(threads) as pool:
        while not follow.is_over and not cancelled:
            rounds = _run_round(pool, runners, follow, interrupt)
            cancelled = rounds is None
            if rounds is not None:
                tables += rounds
                follow.report(results_of(pa.concat_tables(rounds), follow.finished, follow.requested, study.results))
                if progress:
                    progress(follow.finished, study.most)
    if not tables:
        raise KeyboardInterrupt
    table = pa.concat_tables(tables)
    build = max(r.build_seconds for r in runners)
    swept = Sweep(plan, table, time.perf_counter() - began, sum(r.seconds for r in runners), build, cancelled)
    return StudyResult(follow.answer | ({"why": "cancelled"} if cancelled else {}), swept)


def _run_round(
    pool: ThreadPoolExecutor, runners: list[Runner], follow: StudyProgress, interrupt: Any
) -> list[pyarrow.Table] | None:
    """The tables of the requested cases, in order; None after Ctrl-C."""

    def look() -> None:
        if interrupt.asked:
            raise Unwanted

    def piece(n: int) -> Any:
        with watched(look):
            return runners[n].chunk(int(ends[n]), int(ends[n + 1]), lambda done: not interrupt.asked)

    count = min(len(runners), follow.requested - follow.finished)
    ends = [follow.finished + (follow.requested - follow.finished) * k // count for k in range(count + 1)]
    try:
        return [w.result() for w in [pool.submit(piece, n) for n in range(count)]]
    except (Stopped, Unwanted):
        return None
