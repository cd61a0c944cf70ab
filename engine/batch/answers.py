"""Questions to the table of a sample: which numbers decide over its results, and how those are spread."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from engine.basics.problems import Problem, SceneError
from engine.batch.cases import Cases
from engine.batch.indices import Indices, indices
from engine.batch.quantiles import USUAL, Spread, spread
from engine.batch.reductions import ERROR, Reduction
from engine.scene.quantities import agree, parse_quantity
from engine.scene.suggest import shown
from engine.scene.units import UnitError

if TYPE_CHECKING:
    import pyarrow


def indices_of(cases: Cases, kept: Sequence[Reduction], table: pyarrow.Table, of: Sequence[str] = ()) -> list[Indices]:
    """Sobol indices of results (default: all that were kept), and of failing where some cases failed. SceneError where the cases
    are no crossed sample, too few have been run, or a result was not kept."""
    problems = _unkept(kept, of)
    if cases.sampling != "saltelli":
        what = "Sobol indices need a crossed sample, which this is not"
        problems.append(Problem("sampling", what, "a sample with the method saltelli"))
    if problems:
        raise SceneError(problems)
    return indices(table, cases.paths, list(of) or [r.name for r in kept if r.kind != ERROR], {r.name: r.unit for r in kept})


def spreads_of(
    cases: Cases,
    kept: Sequence[Reduction],
    table: pyarrow.Table,
    of: Sequence[str] = (),
    at: Sequence[float] = USUAL,
    above: Mapping[str, Sequence[Any]] | None = None,
) -> list[Spread]:
    """Quantiles at probabilities, and probabilities of being above bounds ({result: bounds}, units allowed), of results (default:
    all that were kept). SceneError where the cases are no sample, or with all that is wrong with the question."""
    above, units = above or {}, {r.name: r.unit for r in kept}
    problems = refused(cases, kept, of, at, above)
    if problems:
        raise SceneError(problems)
    bounds = {n: [bound(b, units[n], f"above.{n}", problems) for b in given] for n, given in above.items()}
    if cases.sampling == "saltelli":  # only the first and the last case of a point are a sample: the others repeat their numbers
        each = 2 * len(cases.paths) + 2
        table = table.filter(np.isin(table["case"].to_numpy() % each, (0, each - 1)))
    done = np.array(table["outcome"].to_pylist(), object) == "done"
    out = []
    for name in list(of) or [r.name for r in kept if r.kind != ERROR]:
        values = np.where(done, table[name].to_numpy().astype(float), np.nan)
        out.append(spread(name, units[name], values, cases.sampling, at, bounds.get(name, ())))
    return out


def refused(
    cases: Cases, kept: Sequence[Reduction], of: Sequence[str], at: Sequence[float], above: Mapping[str, Sequence[Any]]
) -> list[Problem]:
    """All that is wrong with a question about how results are spread."""
    units = {r.name: r.unit for r in kept}
    problems = _unkept(kept, [*of, *above])
    if not cases.sampling:
        problems.append(Problem("sampling", "quantiles are of a sample, which these cases are not", "sample, not over or cases"))
    problems += [Problem("at", f"{p:g} is no probability", "between 0 and 1, such as 0.95") for p in at if not 0.0 < p < 1.0]
    for n in (n for n in above if n in units):
        for b in above[n]:
            bound(b, units[n], f"above.{n}", problems)
    return problems


def _unkept(kept: Sequence[Reduction], of: Sequence[str]) -> list[Problem]:
    names = [r.name for r in kept]
    return [
        Problem("of", f"{shown(n)} was not kept", f"one of {', '.join(names)}"[:1000]) for n in dict.fromkeys(of) if n not in names
    ]


def bound(given: Any, unit: str, where: str, problems: list[Problem]) -> float:
    """A number in the unit of its result; NaN, and a problem on the list, when it is none."""
    try:
        if isinstance(given, str):
            try:
                given = float(given)
            except ValueError:
                given = parse_quantity(given)
                agree(given, unit)
        if isfinite(given):
            return float(given)
        problems.append(Problem(where, f"{given:g} is not finite"))
    except UnitError as e:
        problems.append(Problem(where, e.what, e.hint))
    return float("nan")
