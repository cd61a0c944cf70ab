"""Queries of a sample's table: Sobol indices and distributions of its results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.basics.errors import Problem, raise_problems
from trunnion.batch.cases.grids_and_samples import Cases
from trunnion.batch.sample_statistics.quantiles_and_probabilities import USUAL, Spread, spread
from trunnion.batch.sample_statistics.sobol_indices import Indices, indices
from trunnion.batch.tables.reductions import ERROR, Reduction
from trunnion.scene.findings.name_suggestions import shown
from trunnion.scene.units.numbers_with_units import agree, parse_quantity
from trunnion.scene.units.unit_parser import UnitError

if TYPE_CHECKING:
    import pyarrow


def indices_of(cases: Cases, kept: Sequence[Reduction], table: pyarrow.Table, of: Sequence[str] = ()) -> list[Indices]:
    """Sobol indices of results (default: all reductions), and of failures if cases failed.

    SceneError if the cases are not a crossed sample, if there are too few cases, or if the table lacks a result.
    """
    problems = _unkept(kept, of)
    if cases.sampling != "saltelli":
        what = "Sobol indices need a crossed sample"
        problems.append(Problem("sampling", what, "sample with the method saltelli"))
    raise_problems(problems)
    return indices(table, cases.paths, list(of) or [r.name for r in kept if r.kind != ERROR], {r.name: r.unit for r in kept})


def spreads_of(
    cases: Cases,
    kept: Sequence[Reduction],
    table: pyarrow.Table,
    of: Sequence[str] = (),
    at: Sequence[float] = USUAL,
    above: Mapping[str, Sequence[Any]] | None = None,
) -> list[Spread]:
    """Quantiles at probabilities, and probabilities above bounds, of results (default: all reductions).

    above: {result: bounds}, units allowed. SceneError unless the cases are a sample, and for every problem of the query."""
    above, units = above or {}, {r.name: r.unit for r in kept}
    problems = refused(cases, kept, of, at, above)
    raise_problems(problems)
    bounds = {n: [bound(b, units[n], f"above.{n}", problems) for b in given] for n, given in above.items()}
    if cases.sampling == "saltelli":  # the first and last cases of the points are samples; the other cases mix their numbers
        each = 2 * len(cases.paths) + 2
        table = table.filter(np.isin(table["case"].to_numpy() % each, (0, each - 1)))
    done = np.array(table["outcome"].to_pylist(), object) == "done"
    names = list(of) or [r.name for r in kept if r.kind != ERROR]
    results = ((name, np.where(done, table[name].to_numpy().astype(float), np.nan)) for name in names)
    return [spread(name, units[name], values, cases.sampling, at, bounds.get(name, ())) for name, values in results]


def refused(
    cases: Cases, kept: Sequence[Reduction], of: Sequence[str], at: Sequence[float], above: Mapping[str, Sequence[Any]]
) -> list[Problem]:
    """All problems of a query for quantiles or probabilities."""
    units = {r.name: r.unit for r in kept}
    problems = _unkept(kept, [*of, *above])
    if not cases.sampling:
        problems.append(Problem("sampling", "quantiles need a sample", "use sample in place of vary or cases"))
    problems += [Problem("at", f"{p:g} is not a probability", "between 0 and 1, such as 0.95") for p in at if not 0.0 < p < 1.0]
    for n in (n for n in above if n in units):
        for b in above[n]:
            bound(b, units[n], f"above.{n}", problems)
    return problems


def _unkept(kept: Sequence[Reduction], of: Sequence[str]) -> list[Problem]:
    names = [r.name for r in kept]
    return [
        Problem("of", f"{shown(n)} is not in the table", f"one of {', '.join(names)}"[:1000])
        for n in dict.fromkeys(of) if n not in names
    ]


def bound(given: Any, unit: str, where: str, problems: list[Problem]) -> float:
    """A bound in the unit of its result. For a wrong bound, a problem is appended to ``problems`` and the result is NaN."""
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
