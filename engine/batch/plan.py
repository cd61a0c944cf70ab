"""A batch as understood from what the caller asked: scene, cases, reductions, settings. Any chunk of it can be run anywhere and
gives the same rows."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from math import isfinite
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from engine.basics.interrupts import Unwanted
from engine.basics.problems import Problem, SceneError
from engine.batch.cases import Cases, grid, listed, sampled
from engine.batch.certain import CertainLoop
from engine.batch.ended import Ended
from engine.batch.loop import Loop
from engine.batch.preparing import Preparer, Rows, same_tables
from engine.batch.reductions import Reduction, about_errors, reductions, with_errors
from engine.batch.series import Series, series_of
from engine.batch.table import schema
from engine.kernel.columns import columns
from engine.scene.model import Scene
from engine.simulation import block as bl
from engine.simulation.asked import check_settings
from engine.simulation.bounded import bounds_of
from engine.simulation.choosing import kernel_for
from engine.simulation.settings import Run
from engine.system.build import build

if TYPE_CHECKING:
    import pyarrow

T = TypeVar("T")


@dataclass(frozen=True)
class Plan:
    """What a batch computes: ``scene``, with the fixed changes made; its cases; the reductions kept of each; and the settings
    given. series: what is kept of their rows."""

    scene: Scene
    cases: Cases
    reductions: tuple[Reduction, ...]
    run: Run
    about: dict[str, Any] = field(default_factory=dict, compare=False)
    series: Series | None = None

    @cached_property
    def kernel(self) -> str:
        """What evaluates all its cases."""
        asked = self.run.kernel
        return asked if asked == "lanes" else kernel_for(asked, build(self.scene).system, self.cases.count)

    @property
    def schema(self) -> pyarrow.Schema:
        """The Arrow schema of the batch's table."""
        return schema(self.cases.paths, self.cases.units, self.reductions, self.about | {"kernel": self.kernel})


def plan(
    scene: Scene,
    over: Mapping[str, Any] | None = None,
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
) -> Plan:
    """Understand a batch: exactly one of ``over`` (grid), ``cases`` (list) and ``sample`` (ranges, with ``count`` and ``seed``).

    keep: the reductions, as text; run: settings for all cases; trajectories: patterns of columns
    whose rows are kept, spacing: how far apart, s; most: largest number of cases allowed; certify: keep the error of each reduction
    too; wrong: problems found before, told with the others. SceneError with every problem.
    """
    run = run or Run()
    ways = [w for w in (over, cases, sample) if w is not None]
    if len(ways) != 1:
        what = "nothing says what varies" if not ways else "more than one way of saying what varies"
        raise SceneError([Problem("over", what, "give exactly one of over (grid), cases (list) and sample (ranges)")])
    problems = list(wrong)
    everything = columns(build(scene).system)
    chosen = _found(problems, lambda: with_errors(reductions(keep, everything), certify))
    series = series_of(everything, trajectories, spacing, problems)
    if over is not None:
        found = _found(problems, partial(grid, scene, over))
    elif cases is not None:
        found = _found(problems, partial(listed, scene, cases))
    else:
        found = _found(problems, partial(sampled, scene, sample or {}, count, seed, sampling))
    _found(problems, partial(check_run, scene, run))
    if found is not None and most is not None and found.count > most:
        what = f"{found.count} cases are more than the {most} allowed"
        problems.append(Problem("cases", what, "split the batch, or ask for a higher limit"))
    if problems or found is None or chosen is None:
        raise SceneError(problems)
    return Plan(scene, found, chosen, run, series=series)


def _found(problems: list[Problem], work: Callable[[], T]) -> T | None:
    """What ``work`` returns; None when it raises SceneError, whose problems are kept."""
    try:
        return work()
    except SceneError as e:
        problems += e.problems
        return None


def check_run(scene: Scene, run: Run) -> None:
    """Refuse settings that no case can be run with: SceneError with everything that is wrong."""
    until, every, rtol = run.of(scene)
    unlimited = [
        Problem(n, f"{v:g} is not finite") for n, v in (("until", until), ("every", every), ("rtol", rtol)) if not isfinite(v)
    ]
    if unlimited:
        raise SceneError(unlimited)
    check_settings(until, every, bl.Settings(rtol=rtol, method=run.method_of(scene), **bounds_of(scene)), scene)


class Stopped(Exception):
    """Raised when the caller's tick said no. table: the rows of the cases that were finished by then."""

    def __init__(self, table: pyarrow.Table):
        super().__init__("stopped between two cases")
        self.table = table


class Runner:
    """Runs chunks of a plan, and keeps what they share (kernels, blocks, built values). For one thread at a time."""

    def __init__(self, plan: Plan):
        self.plan = plan
        self.preparer = Preparer(plan.scene, plan.cases.paths, plan.run)
        self.loops: list[Loop | CertainLoop] = []
        self.seconds = 0.0
        self.rows: pyarrow.Table | None = None

    @property
    def build_seconds(self) -> float:
        """Time of symbolic build and compilation so far, s (0 when all came from the cache)."""
        return sum(x.build_seconds for x in self.loops)

    def chunk(self, start: int, stop: int, tick: Callable[[int], bool] | None = None) -> pyarrow.Table:
        """Table of the cases start … stop − 1. ``tick`` is told how many of them are done; when it says no, Stopped is raised.
        Where rows are kept, ``rows`` is their table then."""
        values = self.plan.cases.values(start, stop)
        rows, wrong = self.preparer.rows(values)
        ended = Ended(stop - start, len(self.plan.reductions), wrong)
        before, series = 0, list[np.ndarray]()
        for r in rows:
            try:
                loop = self._loop(r)
            except Unwanted:
                break
            got = loop.run(r, None if tick is None else partial(_told, tick, before))
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

    def _loop(self, rows: Rows) -> Loop | CertainLoop:
        """The loop for cases of this structure, made when there is none yet."""
        for loop in self.loops:
            if fits(loop, rows):
                return loop
        kind = CertainLoop if about_errors(self.plan.reductions) else Loop
        self.loops.append(kind(rows, self.plan.reductions, self.plan.run, self.plan.kernel, self.plan.series))
        del self.loops[:-16]
        return self.loops[-1]


def _told(tick: Callable[[int], bool], before: int, done: int) -> bool:
    """Tell ``tick`` how many cases of the chunk are done, when ``before`` of them are done by earlier loops; gives its answer."""
    return tick(before + done)


def fits(loop: Loop | CertainLoop, rows: Rows) -> bool:
    """Whether the loop's blocks can run these cases: same structure, tables and kinks."""
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
