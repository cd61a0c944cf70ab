"""Requested accuracies compared with true errors and costs: bundled models and random mechanisms, 1e-3 … 1e-9. ``python -m
tests.benchmarks.numerical_error.accuracy_option_cost [--random N] [--seed WORD]``. The script runs three methods at half decades of
rtol. The cheapest run is the run that meets the accuracy with the fewest evaluations. A Jacobian counts as one evaluation for each
number of the state."""

from __future__ import annotations

import argparse
from dataclasses import dataclass, field
from multiprocessing import Pool

import numpy as np

from tests.benchmarks.numerical_error.global_error_estimates import METHODS, MOST_STEPS, ROWS, _try, scene, scenes
from trunnion.simulation.execution.runnable_model import Model
from trunnion.simulation.global_error.column_error_kinds import differences, kinds
from trunnion.simulation.global_error.tolerance_search import Bound, ErrorRequest, read_bound, search_tolerance
from trunnion.simulation.results.result import Result
from trunnion.simulation.runtime_interface.simulation_block import Settings

ACCURACIES = tuple(10.0**-k for k in range(3, 10))
DEAR = 4.0
HALVES = tuple(10.0 ** (-k / 2) for k in range(4, 25))


@dataclass
class Found:
    """Figures of one scene: numbers of accuracies that were requested, that were reported as met, and that the true error met.
    Costs are relative to the cheapest run, costs of the tries relative to the chosen run. Lists of expensive runs, of accuracies
    reported as not met, and of defects."""

    name: str
    asked: int = 0
    said: int = 0
    met: int = 0
    costs: list[float] = field(default_factory=list)
    dear: list[str] = field(default_factory=list)
    unmet: list[str] = field(default_factory=list)
    wrong: list[str] = field(default_factory=list)


def measured(given: tuple[str, str]) -> Found:
    """Figures of one scene."""
    out = Found(given[0])
    try:
        ready = scene(given[1])
        model = Model(ready, ("*",))
        until = float(ready.simulation.until)
        exact = _try(model, until, Settings(1e-13, max_steps=10 * MOST_STEPS))
        if exact is None:
            return out
        k = kinds(model.columns, model.built.numbers)
        ladder = [(_cost(r), r) for m in METHODS for t in HALVES if (r := _try(model, until, Settings(t, m, max_steps=MOST_STEPS)))]
        for a in ACCURACIES:
            bound = read_bound(a, model.columns, ("*",))
            r = search_tolerance(model, ErrorRequest(until, until / ROWS, Settings(max_steps=MOST_STEPS), a), bound, None)
            out.asked += 1
            if r.certainty is None or not r.certainty.met:
                out.unmet.append(f"{out.name} {a:g}: {r.outcome.name}, {r.certainty and r.certainty.promise}")
                continue
            out.said += 1
            true = _error(r, exact, bound, k)
            out.met += true <= a
            if true > a:
                out.wrong.append(f"{out.name} {a:g}: rtol {r.settings['rtol']:.1e}, true {true:.2g}")
            good = [cost for cost, other in ladder if _error(other, exact, bound, k) <= a]
            out.costs += [_cost(r) / min(good)] if good else []
            if good and out.costs[-1] > DEAR:
                by = f"{r.settings['method']} {r.settings['rtol']:.1e}, {_cost(r):.0f} evaluations for {min(good):.0f}"
                out.dear.append(f"{out.costs[-1]:.1f} times the cheapest: {out.name} {a:g}: {by}")
    except Exception as e:  # noqa: BLE001 (the script prints the exception and measures the other scenes)
        out.wrong.append(f"{out.name}: {type(e).__name__} {e}"[:100])
    return out


def _cost(r: Result) -> float:
    states = sum(c.quantity.name in ("q", "qd") for c in r.columns)
    return r.stats.rhs_evaluations + r.stats.jacobians * states


def _error(r: Result, exact: Result, bound: Bound, k: object) -> float:
    n = min(len(r), len(exact))
    return float(differences(r.data[:n, 1:], exact.data[:n, 1:], k)[:, list(bound.places)].max())  # type: ignore[arg-type]


def main() -> None:
    """Measure all scenes and print their figures."""
    asked = argparse.ArgumentParser()
    asked.add_argument("--random", type=int, default=80)
    asked.add_argument("--seed", default="held")
    a = asked.parse_args()
    with Pool(2) as pool:
        found = list(pool.imap_unordered(measured, scenes(a.random, a.seed, (), True)))
    total, said, met = (sum(getattr(f, n) for f in found) for n in ("asked", "said", "met"))
    costs = np.array([c for f in found for c in f.costs])
    print(f"{len(found)} scenes, {total} accuracies asked; said to be met {said / total:.4f}; of these truly met {met / said:.4f}")
    print(f"run over the cheapest: median {np.median(costs):.2f}, within 4: {np.mean(costs <= 4):.4f}, most {costs.max():.1f}")
    print(*(f"  {w}" for f in found for w in (*f.wrong, *(f"not met: {u}" for u in f.unmet), *f.dear)), sep="\n")


if __name__ == "__main__":
    main()
