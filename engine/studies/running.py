"""Studies on this machine's cores: rounds of cases, each round's numbers following from the last."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from engine.basics.extras import brought
from engine.basics.interrupts import held, watched
from engine.batch.plan import Plan, Run, Runner
from engine.batch.sweeping import Sweep
from engine.scene.given import Amount, Names, names_given
from engine.scene.overrides import Given, scene_given
from engine.simulation.settings import described, settings_read
from engine.studies.asked import Wanted, study_of, with_values
from engine.studies.following import Follow, Study, seen_of

if TYPE_CHECKING:
    import pyarrow

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Studied:
    """A study that was run. answer: what it found, as plain data; sweep: all its cases in the order in which they were asked
    for."""

    answer: dict[str, Any]
    sweep: Sweep

    def __repr__(self) -> str:
        return f"<{self.answer['kind']} of {self.sweep.plan.scene.name}: {self.answer['cases']} cases, {self.answer['why']}>"

    @property
    def best(self) -> dict[str, float]:
        """Of the best numbers: {path: SI value}, to be given as ``overrides``."""
        return {n["path"]: n["value"] for n in self.answer.get("numbers", ())}

    @property
    def boundaries(self) -> list[dict[str, Any]]:
        """Of refining: the boxes (low, high) in which outcomes change or the result jumps."""
        return list(self.answer.get("boundaries", ()))

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the table of its cases, as ``Sweep.save``."""
        return self.sweep.save(path)


@described("engine.sweep")
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
    patience: Amount | None = None,
    steps: Amount | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Studied:
    """The best numbers of a scene within bounds {path: (low, high)}.

    Exactly one of minimise and maximise ("max:ball.contact[1].normal_force", any reduction) and reach (a reduction and the value it
    shall have). within: {reduction: (low, high)}, None for no end, which the best shall keep. cases: most that are run; tolerance:
    how near to the best numbers, of their ranges; reductions: what is kept besides. Cases that fail rank last. The same seed gives
    the same cases. Ctrl-C ends it with what it has. Raises SceneError for wrong input.
    """
    goals = {n: g for n, g in (("minimise", minimise), ("maximise", maximise), ("reach", reach)) if g is not None}
    wanted = Wanted("optimise", bounds, goals, within or {}, cases=cases, seed=seed, tolerance=tolerance)
    settings = {"until": until, "every": every, "rtol": rtol, "method": method, "kernel": kernel}
    settings |= {"patience": patience, "steps": steps}
    return _run(scene, wanted, names_given(reductions), overrides, settings, workers, progress)


@described("engine.sweep")
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
    patience: Amount | None = None,
    steps: Amount | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Studied:
    """Where within ranges {path: (low, high)} outcomes change, and (of: a reduction) where a result jumps or bends: cases are added
    there until what is between them is straight, or narrower than ``tolerance`` of the ranges, or there are ``cases``. Up to four
    numbers. Raises SceneError for wrong input."""
    wanted = Wanted("refine", bounds, of=of, cases=cases, tolerance=tolerance)
    settings = {"until": until, "every": every, "rtol": rtol, "method": method, "kernel": kernel}
    settings |= {"patience": patience, "steps": steps}
    return _run(scene, wanted, names_given(reductions), overrides, settings, workers, progress)


def _run(
    scene: Given, wanted: Wanted, keep: Sequence[str], overrides: Mapping[str, Any] | None, settings: dict[str, Any],
    workers: int | None, progress: Progress | None,
) -> Studied:  # fmt: skip
    loaded = scene_given(scene, overrides)
    values, wrong = settings_read("engine.sweep", settings)
    study, plan = study_of(loaded, wanted, keep, Run(**values), wrong)
    return run_study(study, plan, workers, progress)


def run_study(study: Study, plan: Plan, workers: int | None = None, progress: Progress | None = None) -> Studied:
    """Run a study on threads. KeyboardInterrupt when it is stopped before its first round is finished."""
    import pyarrow as pa
    import pyarrow.compute as pc

    brought("pyarrow", "tables", "a table of cases")
    follow, began = Follow(study), time.perf_counter()
    plan = with_values(study, plan, follow.rows)
    threads = max(1, workers or os.cpu_count() or 1)
    runners, tables = [Runner(plan) for _ in range(threads)], list[Any]()
    stopped = False
    with held() as interrupt, ThreadPoolExecutor(threads) as pool:
        while not follow.over and not stopped:
            rounds = _round(pool, runners, follow, interrupt)
            stopped = rounds is None
            if rounds is not None:
                tables += rounds
                follow.tell(seen_of(pa.concat_tables(rounds), follow.known, follow.asked, study.results))
                if progress:
                    progress(follow.known, study.most)
    if not tables:
        raise KeyboardInterrupt
    table = pa.concat_tables(tables)
    counts = {c["values"]: c["counts"] for c in pc.value_counts(table["outcome"]).to_pylist()}
    build = max(r.build_seconds for r in runners)
    swept = Sweep(plan, table, time.perf_counter() - began, sum(r.seconds for r in runners), build, counts, stopped)
    return Studied(follow.answer | ({"why": "interrupted"} if stopped else {}), swept)


def _round(pool: ThreadPoolExecutor, runners: list[Runner], follow: Follow, interrupt: Any) -> list[pyarrow.Table] | None:
    """The tables of the cases that wait, in order; None when Ctrl-C was pressed."""
    from engine.basics.interrupts import Unwanted
    from engine.batch.plan import Stopped

    def look() -> None:
        if interrupt.asked:
            raise Unwanted

    def piece(n: int) -> Any:
        with watched(look):
            return runners[n].chunk(int(ends[n]), int(ends[n + 1]), lambda done: not interrupt.asked)

    count = min(len(runners), follow.asked - follow.known)
    ends = [follow.known + (follow.asked - follow.known) * k // count for k in range(count + 1)]
    try:
        return [w.result() for w in [pool.submit(piece, n) for n in range(count)]]
    except (Stopped, Unwanted):
        return None
