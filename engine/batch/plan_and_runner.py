"""Plans of batches (scene, cases, reductions, settings), and the runner that computes chunks of a plan. A chunk gives the same rows
on any machine."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property, partial
from math import isfinite
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from trunnion.basics.errors import Problem, SceneError, raise_problems
from trunnion.basics.interrupts import Unwanted
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.basics.renamed_words import current_paths
from trunnion.batch.cases.grids_and_samples import Cases, grid, listed, sampled
from trunnion.batch.execution.c_case_loop import Loop
from trunnion.batch.execution.chunk_results import ChunkResults
from trunnion.batch.execution.error_estimate_loop import ErrorEstimateLoop
from trunnion.batch.preparation.case_parameters import Preparer, Rows, same_tables
from trunnion.batch.tables.case_table import schema
from trunnion.batch.tables.reductions import Reduction, about_errors, reductions, with_errors
from trunnion.batch.tables.trajectories import Series, series_of
from trunnion.kernel.interface.output_columns import columns
from trunnion.scene.data_classes.scene import Scene
from trunnion.simulation.runtime_interface import simulation_block as bl
from trunnion.simulation.settings.kernel_choice import kernel_for
from trunnion.simulation.settings.realtime_steps import bounds_of
from trunnion.simulation.settings.request_checks import check_settings
from trunnion.simulation.settings.run_settings import Run
from trunnion.system.construction.system_builder import build
from trunnion.system.structure.bodies_and_joints import System

if TYPE_CHECKING:
    import pyarrow

T = TypeVar("T")


@dataclass(frozen=True)
class Plan:
    """The plan of a batch.

    Attributes:
        scene: the scene, including the changes that apply to all cases.
        cases: the cases.
        reductions: reductions of each case.
        run: settings of the runs.
        about: metadata of the table.
        series: the rows to store for each case; None if no rows are stored.
        system: the structure of the scene, if it is known.
    """

    scene: Scene
    cases: Cases
    reductions: tuple[Reduction, ...]
    run: Run
    about: dict[str, Any] = field(default_factory=dict, compare=False)
    series: Series | None = None
    system: System | None = field(default=None, compare=False, repr=False)

    @cached_property
    def kernel(self) -> str:
        """The kind of kernel for all cases."""
        wanted = self.run.kernel
        return wanted if wanted == "lanes" else kernel_for(wanted, self.system or build(self.scene).system, self.cases.count)

    def is_like(self, other: Plan) -> bool:
        """Whether another plan differs from this one only in its cases."""
        return replace(self, cases=other.cases) == other and self.kernel == other.kernel

    @property
    def schema(self) -> pyarrow.Schema:
        """The Arrow schema of the batch's table."""
        return schema(self.cases.paths, self.cases.units, self.reductions, self.about | {"kernel": self.kernel})


def plan(
    scene: Scene,
    vary: Mapping[str, Any] | None = None,
    cases: Sequence[Mapping[str, Any]] | None = None,
    sample: Mapping[str, Any] | None = None,
    *,
    count: int = 0,
    seed: int = 0,
    sampling: str = "latin",
    keep: Sequence[str] = (),
    run: Run | None = None,
    trajectories: Sequence[str] = (),
    spacing: float | None = None,
    most: int | None = None,
    certify: bool = False,
    wrong: Sequence[Problem] = (),
    earlier: Plan | None = None,
) -> Plan:
    """The plan of a batch, from exactly one of ``vary`` (grid), ``cases`` (list) and ``sample`` (ranges, with ``count`` and
    ``seed``).

    keep: reductions as text; run: settings of all cases; trajectories: patterns of columns whose rows are stored; spacing: spacing
    of the stored rows, s; most: largest number of cases; certify: whether to estimate the errors of the reductions, too; wrong:
    problems that were found earlier; earlier: a plan with the same arguments except for its cases, whose structure is reused.
    SceneError lists every problem.
    """
    run = run or Run()
    ways = [w for w in (vary, cases, sample) if w is not None]
    if len(ways) != 1:
        what = "nothing varies" if not ways else "more than one of vary, cases and sample is given"
        raise SceneError([Problem("vary", what, "give exactly one of vary (grid), cases (list) and sample (ranges)")])
    vary, sample, problems = vary and current_paths(vary), sample and current_paths(sample), list(wrong)
    if earlier is None:
        system = build(scene).system
        everything = columns(system)
        chosen = _found(problems, lambda: with_errors(reductions(keep, everything), certify))
        series = series_of(everything, trajectories, spacing, problems)
    else:
        system, chosen, series = earlier.system or build(scene).system, earlier.reductions, earlier.series
    if vary is not None:
        found = _found(problems, partial(grid, scene, vary))
    elif cases is not None:
        found = _found(problems, partial(listed, scene, _current_cases(cases)))
    else:
        found = _found(problems, partial(sampled, scene, sample or {}, count, seed, sampling))
    _found(problems, partial(check_run, scene, run))
    if found is not None and most is not None and found.count > most:
        what = f"{found.count} cases are more than the {most} allowed"
        problems.append(Problem("cases", what, "split the batch, or raise the limit"))
    if problems or found is None or chosen is None:
        raise SceneError(problems)
    return Plan(scene, found, chosen, run, series=series, system=system)


def _current_cases(cases: Sequence[Mapping[str, Any]]) -> Sequence[Mapping[str, Any]]:
    """The cases with current names of paths. All cases have the same paths, so only the first case is checked."""
    return cases if not cases or list(current_paths(cases[0])) == list(cases[0]) else [current_paths(c) for c in cases]


def _found(problems: list[Problem], work: Callable[[], T]) -> T | None:
    """The result of ``work``. If ``work`` raises SceneError, the problems are appended to ``problems`` and the result is None."""
    try:
        return work()
    except SceneError as e:
        problems += e.problems
        return None


def check_run(scene: Scene, run: Run) -> None:
    """Raise SceneError with every problem of the settings of a run."""
    until, every, rtol = run.of(scene)
    unlimited = [
        Problem(n, f"{v:g} is not finite") for n, v in (("until", until), ("every", every), ("rtol", rtol)) if not isfinite(v)
    ]
    raise_problems(unlimited)
    check_settings(until, every, bl.Settings(rtol=rtol, method=run.method_of(scene), **bounds_of(scene)), scene)


class Stopped(Exception):
    """The caller's ``tick`` returned False. table: rows of the finished cases."""

    def __init__(self, table: pyarrow.Table):
        super().__init__("stopped between two cases")
        self.table = table


class Runner:
    """Runs chunks of a plan and reuses kernels, memory blocks and built scenes. One thread at a time may use a runner. preparer:
    the preparer of another runner of this plan. Both runners then share the built scenes of the preparer. earlier: a runner whose
    plan differs only in its cases. This runner reuses its structure, kernel and blocks, and, if the same numbers vary, its built
    scenes."""

    def __init__(self, plan: Plan, preparer: Preparer | None = None, earlier: Runner | None = None):
        self.plan = plan
        start = earlier.preparer.start if earlier else None
        if earlier and earlier.plan.cases.paths == plan.cases.paths:
            preparer = earlier.preparer
        self.preparer: Preparer = preparer or Preparer(plan.scene, plan.cases.paths, plan.run, plan.cases.ends, start)
        earlier_loops = earlier.loops if earlier else []
        self.loops: list[Loop | ErrorEstimateLoop] = [x for x in earlier_loops if x.model.built is start]
        self.seconds = 0.0
        self.rows: pyarrow.Table | None = None

    @property
    def build_seconds(self) -> float:
        """Time of symbolic build and compilation so far, s; 0 with cached kernels."""
        return sum(x.build_seconds for x in self.loops)

    def chunk(self, start: int, stop: int, tick: Callable[[int], bool] | None = None) -> pyarrow.Table:
        """Table of the cases start … stop − 1. ``tick`` receives the number of finished cases. If ``tick`` returns False, raises
        Stopped.

        If rows are stored, ``self.rows`` holds their table after the call.
        """
        values = self.plan.cases.values(start, stop)
        rows, wrong = self.preparer.rows(values)
        ended = ChunkResults(stop - start, len(self.plan.reductions), wrong)
        before, series = 0, list[np.ndarray]()
        for r in rows:
            try:
                loop = self._loop(r)
            except Unwanted:
                break
            got = loop.run(r, tick and (lambda done, before=before: tick(before + done)))  # type: ignore[misc]
            before += len(r.index)
            self.seconds += got.seconds
            ended.take(got)
            if got.kept is not None and len(got.kept):
                series.append(np.column_stack([start + r.index[got.kept[:, 0].astype(int)], got.kept[:, 1:]]))
            if len(got.index) < len(r.index):
                break
        if self.plan.series is not None:
            whole = np.concatenate([np.zeros((0, 2 + len(self.plan.series.columns))), *series])
            self.rows = self.plan.series.table(whole[:, 0], whole[:, 1:])
        made = ended.table(self.plan.schema, start, values)
        if not ended.finished.all():
            raise Stopped(made)
        return made

    def _loop(self, rows: Rows) -> Loop | ErrorEstimateLoop:
        """The loop for cases of this structure. A new loop is made if no existing loop fits."""
        for loop in self.loops:
            if fits(loop, rows):
                return loop
        kind = ErrorEstimateLoop if about_errors(self.plan.reductions) else Loop
        self.loops.append(kind(rows, self.plan.reductions, self.plan.run, self.plan.kernel, self.plan.series))
        del self.loops[:-16]
        return self.loops[-1]


def fits(loop: Loop | ErrorEstimateLoop, rows: Rows) -> bool:
    """Whether the loop's blocks can run these cases. The cases need the structure, tables and breakpoints of the loop."""
    a, b = loop.model.built, rows.built
    if a is b:
        return True
    return (
        a.system == b.system
        and a.parameters.paths == b.parameters.paths
        and a.numbers.breaks == b.numbers.breaks
        and same_tables(a.numbers.tables, b.numbers.tables)
        and a.scene.simulation.method == b.scene.simulation.method
        and bounds_of(a.scene) == bounds_of(b.scene)
    )


__all__ = ["Plan", "Run", "Runner", "Stopped", "plan"]
