"""What ``trunnion sweep`` tells of samples: Sobol indices, quantiles, probabilities of exceeding bounds; and their pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from engine.cli.options import Findings
from engine.cli.summary import plain, table

if TYPE_CHECKING:
    from engine.batch.indices import Estimate, Indices
    from engine.batch.quantiles import Spread
    from engine.batch.sweeping import Sweep

SHOWN = 12


@dataclass(frozen=True)
class Questions:
    """What is asked of a sample: probabilities of quantiles, bounds by result, the file of a picture."""

    at: tuple[float, ...]
    above: Mapping[str, tuple[str, ...]]
    picture: Path | None

    def any(self) -> bool:
        """Whether anything is asked."""
        return bool(self.at or self.above or self.picture)


def questions(quantiles: Sequence[str], above: Sequence[str], picture: Path | None, found: Findings) -> Questions:
    """The questions of the options; mistakes are noted."""
    at, bounds = [], dict[str, tuple[str, ...]]()
    for text in (part.strip() for given in quantiles for part in given.split(",")):
        try:
            at.append(float(text))
        except ValueError:
            found.add("--quantiles", f"{text!r} is no probability", "numbers between 0 and 1, such as 0.05,0.5,0.95")
    for text in above:
        name, sign, value = (part.strip() for part in text.rpartition("="))
        if not sign or not value:
            found.add("--above", f"{text!r} is not KIND:WHAT=BOUND", "such as 'max:ball.contact[1].normal_force=250 N'")
        bounds[name] = (*bounds.get(name, ()), value)
    return Questions(tuple(at), bounds, picture)


@dataclass(frozen=True)
class Answers:
    """What there is to tell of a sample."""

    indices: Sequence[Indices]
    spreads: Sequence[Spread]

    def document(self) -> dict[str, Any]:
        """As plain data."""
        told = {"indices": [i.document() for i in self.indices], "spreads": [s.document() for s in self.spreads]}
        return {name: found for name, found in told.items() if found}

    def lines(self) -> list[str]:
        """As text."""
        out: list[str] = []
        for i in self.indices[:SHOWN]:
            out += ["", *map(plain, index_lines(i))]
        for s in self.spreads[:SHOWN]:
            out += ["", *map(plain, spread_lines(s))]
        more = max(len(self.indices), len(self.spreads)) - SHOWN
        return out + ([f"… and {more} more (--json tells all)"] if more > 0 else [])


def answered(result: Sweep, asked: Questions) -> Answers:
    """The answers to what is asked; the indices of a crossed sample are told unasked. The picture is drawn."""
    from engine.batch.quantiles import USUAL

    crossed = result.plan.cases.sampling == "saltelli"
    indices = result.indices() if crossed else []
    wanted = asked.at or asked.above or (asked.picture and not crossed)
    spreads = result.spreads((), asked.at or USUAL, asked.above) if wanted else []
    if asked.picture:
        _draw(result, indices, spreads, asked.picture)
    return Answers(indices, spreads)


def _draw(result: Sweep, indices: Sequence[Indices], spreads: Sequence[Spread], path: Path) -> None:
    from engine.plots.files import save_figure
    from engine.plots.sampled import histograms, index_bars

    if indices:
        save_figure(index_bars(indices), path)
        return
    done = result.table.filter([x == "done" for x in result.table["outcome"].to_pylist()])
    save_figure(histograms({s.of: done[s.of].drop_null().to_numpy() for s in spreads}, spreads), path)


def index_lines(i: Indices) -> list[str]:
    """Which numbers decide over one result."""
    unit = "" if i.unit in ("", "1") else f" {i.unit}"
    head = f"{i.of}: mean {_estimate(i.mean)}{unit}, standard deviation {_estimate(i.deviation)}{unit}"
    rows = [(p, _estimate(a), _estimate(b)) for p, a, b in zip(i.paths, i.first, i.total, strict=True)]
    lines = [head, *table(("Sobol indices of", "alone (first)", "with all others (total)"), rows)]
    told = sorted(((e.value, pair, e) for pair, e in i.second.items() if e.value is not None and _beyond(e)), reverse=True)
    lines += [f"together: {a} and {b} {_estimate(e)}" for _, (a, b), e in told[:SHOWN]]
    if i.missing:
        lines.append("without a value: " + ", ".join(f"{n} {why.replace('_', ' ')}" for why, n in i.missing.items()))
    return [*lines, *(f"note: {n}" for n in i.notes)]


def _beyond(e: Estimate) -> bool:
    """Whether the interval leaves 0 out."""
    return e.low is not None and e.high is not None and (e.low > 0.0 or e.high < 0.0)


def spread_lines(s: Spread) -> list[str]:
    """How one result is spread."""
    unit = "" if s.unit in ("", "1") else f" {s.unit}"
    rows = [(f"{100 * p:g} % lie below", _estimate(e)) for p, e in s.quantiles]
    rows += [(f"above {b:g}{unit}, probability", _estimate(e)) for b, e in s.above]
    head = f"{s.of}{f', {s.unit}' if unit else ''}: {s.cases} cases" + (f", {s.missing} without a value" if s.missing else "")
    return [head, *table(("", "value (95 % interval)"), rows), f"note: {s.note}"]


def _estimate(e: Estimate) -> str:
    """A number and its interval."""
    if e.value is None:
        return "–"
    low, high = ("no end" if x is None else f"{x:.4g}" for x in (e.low, e.high))
    return f"{e.value:.4g} ({low} to {high})"
