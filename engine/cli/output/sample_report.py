"""Text and pictures of samples: Sobol indices, quantiles, probabilities of exceeding bounds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.cli.options.argument_reader import ArgumentReader
from trunnion.cli.output.printed_output import plain, table

if TYPE_CHECKING:
    from trunnion.batch.sample_statistics.quantiles_and_probabilities import Spread
    from trunnion.batch.sample_statistics.sobol_indices import Estimate, Indices
    from trunnion.batch.sweep import Sweep

SHOWN = 12


@dataclass(frozen=True)
class SampleQueries:
    """The requested statistics of a sample. at: probabilities of the quantiles. above: for each result, the bounds whose
    probability of being exceeded is requested. picture: file of a picture."""

    at: tuple[float, ...]
    above: Mapping[str, tuple[str, ...]]
    picture: Path | None

    def __bool__(self) -> bool:
        return bool(self.at or self.above or self.picture)


def read_queries(quantiles: Sequence[str], above: Sequence[str], picture: Path | None, reader: ArgumentReader) -> SampleQueries:
    """The statistics that the options request. Mistakes are added to ``reader``."""
    at, bounds = [], dict[str, tuple[str, ...]]()
    for text in (part.strip() for given in quantiles for part in given.split(",")):
        try:
            at.append(float(text))
        except ValueError:
            reader.add("--quantiles", f"{text!r} is not a probability", "numbers between 0 and 1, such as 0.05,0.5,0.95")
    for text in above:
        name, sign, value = (part.strip() for part in text.rpartition("="))
        if not sign or not value:
            reader.add("--above", f"{text!r} is not KIND:WHAT=BOUND", "such as 'max:ball.contact[1].normal_force=250 N'")
        bounds[name] = (*bounds.get(name, ()), value)
    return SampleQueries(tuple(at), bounds, picture)


def sample_statistics(result: Sweep, queries: SampleQueries) -> tuple[dict[str, Any], list[str]]:
    """The requested statistics as plain data and as text. For a Saltelli sample, the statistics always include the Sobol indices.
    Draws the requested picture."""
    from trunnion.batch.sample_statistics.quantiles_and_probabilities import USUAL

    crossed = result.plan.cases.sampling == "saltelli"
    indices = result.indices() if crossed else []
    spread = queries.at or queries.above or (queries.picture and not crossed)
    spreads = result.spreads((), queries.at or USUAL, queries.above) if spread else []
    if queries.picture:
        draw(result, indices, spreads, queries.picture)
    found = {"indices": [i.document() for i in indices], "spreads": [s.document() for s in spreads]}
    lines: list[str] = []
    for shown in (*map(index_lines, indices[:SHOWN]), *map(spread_lines, spreads[:SHOWN])):
        lines += ["", *map(plain, shown)]
    more = max(len(indices), len(spreads)) - SHOWN
    lines += [f"… and {more} more (--json lists all)"] if more > 0 else []
    return {name: listed for name, listed in found.items() if listed}, lines


def draw(result: Sweep, indices: Sequence[Indices], spreads: Sequence[Spread], path: Path) -> None:
    """Draw bars of the indices. Without indices, draw histograms."""
    from trunnion.plots.analysis.sobol_bars_and_histograms import draw_histograms, draw_sobol_indices
    from trunnion.plots.style.figure_files import save_figure

    if indices:
        save_figure(draw_sobol_indices(indices), path)
        return
    done = result.table.filter([x == "done" for x in result.table["outcome"].to_pylist()])
    save_figure(draw_histograms({s.of: done[s.of].drop_null().to_numpy() for s in spreads}, spreads), path)


def index_lines(i: Indices) -> list[str]:
    """Sobol indices of one result, as a table."""
    unit = "" if i.unit in ("", "1") else f" {i.unit}"
    head = f"{i.of}: mean {estimate_text(i.mean)}{unit}, standard deviation {estimate_text(i.deviation)}{unit}"
    rows = [(p, estimate_text(a), estimate_text(b)) for p, a, b in zip(i.paths, i.first, i.total, strict=True)]
    lines = [head, *table(("Sobol indices of", "alone (first)", "with all others (total)"), rows)]
    joint = sorted(((e.value, pair, e) for pair, e in i.second.items() if e.value is not None and excludes_zero(e)), reverse=True)
    lines += [f"together: {a} and {b} {estimate_text(e)}" for _, (a, b), e in joint[:SHOWN]]
    if i.missing:
        lines.append("without a value: " + ", ".join(f"{n} {why.replace('_', ' ')}" for why, n in i.missing.items()))
    return [*lines, *(f"note: {n}" for n in i.notes)]


def excludes_zero(e: Estimate) -> bool:
    """Whether the interval of an estimate excludes 0."""
    return e.low is not None and e.high is not None and (e.low > 0.0 or e.high < 0.0)


def spread_lines(s: Spread) -> list[str]:
    """Quantiles and exceedance probabilities of one result."""
    unit = "" if s.unit in ("", "1") else f" {s.unit}"
    rows = [(f"{100 * p:g} % lie below", estimate_text(e)) for p, e in s.quantiles]
    rows += [(f"above {b:g}{unit}, probability", estimate_text(e)) for b, e in s.above]
    head = f"{s.of}{f', {s.unit}' if unit else ''}: {s.cases} cases" + (f", {s.missing} without a value" if s.missing else "")
    return [head, *table(("", "value (95 % interval)"), rows), f"note: {s.note}"]


def estimate_text(e: Estimate) -> str:
    """An estimate and its interval."""
    if e.value is None:
        return "–"
    low, high = ("no end" if x is None else f"{x:.4g}" for x in (e.low, e.high))
    return f"{e.value:.4g} ({low} to {high})"
