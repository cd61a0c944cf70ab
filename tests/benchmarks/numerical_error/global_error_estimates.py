"""Stated errors compared with true ones: every bundled model, scene of the stability gallery and random mechanism, at seven
tolerances, by three methods. ``python -m tests.benchmarks.numerical_error.global_error_estimates [--random N] [--seed WORD] [--only
NAME,…] [--models]``.

A true error is the difference from a run at 1e-13 (auto). An error counts if it exceeds ten times the stated floor and ten times
the uncertainty of the true error. This uncertainty is the difference between the run at 1e-13 and a run at 1e-12 by another method.
At twenty times of each run, the largest error of each column so far is compared. """

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from multiprocessing import Pool
from pathlib import Path

import numpy as np

from tests.benchmarks.numerical_error.coulomb_friction_error import skew_chain
from tests.reference.scenes.random_scenes import random_loop, random_tree
from trunnion.scene import Scene, load_scene, models_dir
from trunnion.simulation.global_error.column_error_kinds import differences, kinds
from trunnion.simulation.global_error.event_pairs import REPORTED, pair_events
from trunnion.simulation.global_error.two_run_comparison import compare_runs
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import Model, run
from trunnion.simulation.runtime_interface.simulation_block import Settings

TOLERANCES = tuple(10.0**-k for k in range(4, 11))
METHODS = ("rk5", "rk8", "rosenbrock")
TIMES, ROWS = 20, 200
LAWS = ("coulomb", "stribeck", "regularized", "lugre", "viscous")
MOST_STEPS = 60_000
SECONDS = 3.0
"""Duration of random scenes."""
LONGEST = 60.0


@dataclass
class Tally:
    """Figures of one scene: ratio of stated to true error; numbers of runs and of complete runs; reasons of the other runs; costs.
    Also the numbers of events and of last positions, and how many of them have true errors within the stated errors; the worst
    ratio and its place."""

    name: str
    ratios: list[np.ndarray] = field(default_factory=list)
    runs: int = 0
    low: int = 0
    reasons: Counter[str] = field(default_factory=Counter)
    shares: list[float] = field(default_factory=list)
    costs: list[float] = field(default_factory=list)
    events: list[int] = field(default_factory=lambda: [0, 0])
    rests: list[int] = field(default_factory=lambda: [0, 0])
    unseen: list[str] = field(default_factory=list)
    worst: list[tuple[float, str]] = field(default_factory=list)


def scenes(random: int, seed: str, only: tuple[str, ...], models: bool) -> Iterator[tuple[str, str]]:
    """Name of every scene, with its file or with the words from which ``scene`` makes the scene."""
    files = [f for p in ("*/scene.yaml", "designer/*/scene.yaml", "stability/*.yaml") for f in models_dir().glob(p)]
    found = [(f.parent.name if f.stem == "scene" else f.stem, str(f)) for f in sorted(files)] if models else []
    found += [(f"{kind}{k}", f"{kind}:{seed}{k}") for k in range(random // 2) for kind in ("tree", "loop")]
    found += [("skew_chain", "skew_chain")] if models else []
    yield from (x for x in found if not only or x[0] in only)


def scene(made: str) -> Scene:
    """The scene of a file, or a random scene."""
    if made == "skew_chain":
        chain = skew_chain()
        return replace(chain, simulation=replace(chain.simulation, until=10.0))
    kind, _, seed = made.partition(":")
    if not seed or Path(made).exists():
        return load_scene(made)
    laws = ("coulomb",) if int(seed[-1]) % 2 else LAWS
    found = (random_tree if kind == "tree" else random_loop)(seed, laws=laws).scene
    return replace(found, simulation=replace(found.simulation, until=SECONDS))


def measured(given: tuple[str, str]) -> Tally:
    """The figures of one scene."""
    name, made = given
    tally = Tally(name)
    try:
        ready = scene(made)
        model = Model(ready, ("*",))
    except Exception as e:  # noqa: BLE001 (the script reports a refused scene and continues with the other scenes)
        tally.reasons[f"refused: {type(e).__name__}"] += 1
        return tally
    until = min(float(ready.simulation.until), LONGEST)
    exact = _try(model, until, Settings(1e-13, max_steps=10 * MOST_STEPS))
    others = (_try(model, until, Settings(1e-12, m, max_steps=10 * MOST_STEPS)) for m in ("rk5", "rosenbrock"))
    again = next(filter(None, others), None)
    if exact is None or again is None:
        tally.reasons["no reference"] += 1
        return tally
    for method in METHODS:
        for rtol in TOLERANCES:
            try:
                settings = Settings(rtol, method, max_steps=MOST_STEPS, through_jams=ready.simulation.jams == "impact")
                found = compare_runs(model, until, until / ROWS, settings)
            except Exception as e:  # noqa: BLE001
                tally.reasons[f"{method}: {type(e).__name__}"] += 1
                break
            if not found.outcome.ok:
                tally.reasons[f"run ends as {found.outcome.name}"] += 1
                if found.outcome.name == "max_steps":
                    break
                continue
            _compare(tally, model, found, exact, again)
    return tally


def _try(model: Model, until: float, settings: Settings) -> Result | None:
    try:
        result = run(model, until, until / ROWS, settings)
    except Exception:  # noqa: BLE001
        return None
    return result if result.outcome.ok else None


def _compare(tally: Tally, model: Model, found: Result, exact: Result, again: Result) -> None:
    """Add the figures of one run to the tally."""
    c = found.certainty
    assert c is not None
    k = kinds(found.columns, model.built.numbers)
    tally.runs += 1
    tally.costs.append(c.cost)
    tally.shares.append(min(c.promise.until / found.time[-1], 1.0))
    tally.reasons["whole" if c.promise.whole else c.promise.why] += 1
    pairs = pair_events(exact.events, again.events, np.inf)
    known = min(pairs.alone, c.promise.until)
    true, unsure = differences(found.data[:, 1:], exact.data[:, 1:], k), differences(exact.data[:, 1:], again.data[:, 1:], k)
    hidden = np.ix_(c.shift > 0.0, k.jumps)
    true[hidden], unsure[hidden] = 0.0, 0.0
    true, unsure = np.maximum.accumulate(true, axis=0), np.maximum.accumulate(unsure, axis=0)
    rows = np.arange(ROWS // TIMES, ROWS + 1, ROWS // TIMES)
    rows = rows[found.time[rows] < known]
    counts = (true[rows] > 10.0 * np.maximum(c.floor, unsure[rows])) & k.errs & np.isfinite(c.error[rows])
    ratio = c.error[rows] / np.maximum(true[rows], 1e-300)
    tally.ratios.append(ratio[counts])
    if counts.any():
        least = ratio[counts].min()
        tally.low += bool(least < 0.2)
        r, i = np.argwhere(counts & (ratio == least))[0]
        where = f"{found.settings['method']} {found.settings['rtol']:.0e} {c.names[i]} t={found.time[rows[r]]:.4g}"
        size = np.abs(found.data[:, i + 1]).max()
        tally.worst.append((least, f"{where}: stated {c.error[rows[r], i]:.2g}, true {true[rows[r], i]:.2g} of {size:.2g}"))
    same = pair_events(found.events, exact.events, found.time[-1] - 1e-3 * until_of(found))
    if same.alone < known:
        tally.reasons["unseen"] += 1
        which = f"{tally.name} {found.settings['method']} {found.settings['rtol']:.0e}"
        tally.unseen.append(f"{which}: {same.about} at {same.alone:.6g} s")
    for i, (t, e) in same.times.items():
        if np.isfinite(c.event_errors[i]) and t < min(known, same.alone) and found.events[i].kind not in REPORTED:
            tally.events[0] += abs(t - e) <= c.event_errors[i]
            tally.events[1] += 1
    if known > found.time[-1]:
        last = [i for i, x in enumerate(found.columns) if x.quantity.name in ("position", "point", "q")]
        tally.rests[0] += int((true[-1, last] <= c.error[-1, last]).sum())
        tally.rests[1] += len(last)


def until_of(found: Result) -> float:
    """The time that a run of the scene reaches, s."""
    return float(found.settings["until"])


def tell(found: list[Tally], worst: int = 10) -> None:
    """Print the figures, with the ``worst`` ratios."""
    ratios = np.concatenate([r for t in found for r in t.ratios])
    reasons: Counter[str] = sum((t.reasons for t in found), Counter())
    costs, shares = [c for t in found for c in t.costs], [s for t in found for s in t.shares]
    print(f"{len(found)} scenes, {sum(t.runs for t in found)} runs, {len(ratios)} figures")
    print(f"within [0.5, 5]: {np.mean((ratios >= 0.5) & (ratios <= 5)):.4f}; below 0.5 {np.mean(ratios < 0.5):.4f}, below 0.2 "
          f"{np.mean(ratios < 0.2):.5f}, above 5 {np.mean(ratios > 5):.4f}; covered (1 and more) {np.mean(ratios >= 1):.4f}")
    print(f"runs with a figure below 0.2: {sum(t.low for t in found)}")
    print(f"cost: median {np.median(costs):.2f}, 95 % {np.percentile(costs, 95):.2f}, most {max(costs):.2f} runs")
    print(f"promised part of the runs: {np.mean(shares):.4f}; reasons: {dict(reasons)}")
    for what, pairs in (("event times", [t.events for t in found]), ("last positions", [t.rests for t in found])):
        covered, all_of = np.sum(pairs, axis=0)
        print(f"{what} covered by their error: {covered / max(all_of, 1):.4f} of {all_of}")
    print("decisions of the exact run that neither of the two has:", *(u for t in found for u in t.unseen), sep="\n  ")
    for least, where in sorted(((w, f"{t.name} {text}") for t in found for w, text in t.worst), key=lambda x: x[0])[:worst]:
        print(f"  {least:.3g} {where}")


def main() -> None:
    """Measure and print."""
    asked = argparse.ArgumentParser()
    asked.add_argument("--random", type=int, default=200)
    asked.add_argument("--seed", default="held")
    asked.add_argument("--only", default="")
    asked.add_argument("--models", action="store_true")
    asked.add_argument("--worst", type=int, default=10)
    a = asked.parse_args()
    todo = list(scenes(a.random, a.seed, tuple(filter(None, a.only.split(","))), a.models))
    with Pool(2) as pool:
        found = list(pool.imap_unordered(measured, todo))
    tell(found, a.worst)


if __name__ == "__main__":
    main()
