"""Pictures of samples: bars of Sobol indices with their intervals, and histograms of results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.plots.style.palette import COLORS, EVENT, GRID, INK
from trunnion.plots.style.panels_and_labels import make_panels, shorten_paths, with_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from trunnion.batch.sample_statistics.quantiles_and_probabilities import Spread
    from trunnion.batch.sample_statistics.sobol_indices import Estimate, Indices

MOST_PANELS, MOST_PAIRS = 12, 10
BINS = 40


def draw_sobol_indices(found: Sequence[Indices]) -> Figure:
    """Draw a panel for each result. A panel has bars of the first and total indices of each number, then bars of the pairs with the
    largest second indices."""
    chosen = list(found[:MOST_PANELS])
    pairs = min(MOST_PAIRS, max(len(i.second) for i in chosen))
    names = len(chosen[0].paths)
    fig, panels = make_panels(len(chosen), 2, (6.2, 1.7 + 0.42 * (names + pairs)))
    for axes, i in zip(panels, chosen, strict=True):
        largest = sorted(i.second.items(), key=lambda p: -abs(p[1].value or 0.0))[:pairs]
        short = shorten_paths(i.paths)
        words = [short[p] for p in i.paths] + [f"{short[a]} × {short[b]}" for (a, b), _ in largest]
        at = np.arange(len(words), dtype=float)
        _bars(axes, at[:names] - 0.2, i.first, COLORS[0], "alone (first)")
        _bars(axes, at[:names] + 0.2, i.total, COLORS[1], "with all others (total)")
        _bars(axes, at[names:], [e for _, e in largest], COLORS[2], "two together (second)")
        axes.axvline(0.0, color=INK, linewidth=0.8)
        axes.set_yticks(at, words, fontsize=8)
        axes.invert_yaxis()
        axes.set_xlabel("part of the variance, 95 % intervals", fontsize=8)
        axes.set_title(f"{i.of}\n{_mean_and_deviation(i)}", fontsize=9)
        axes.grid(axis="x", color=GRID)
        axes.set_axisbelow(True)
        if i.first[0].value is None:
            axes.text(0.5, 0.5, i.notes[0] if i.notes else "no index can be estimated", transform=axes.transAxes, ha="center")
    fig.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    return fig


def _mean_and_deviation(i: Indices) -> str:
    if i.mean.value is None or i.deviation.value is None:
        return "no spread"
    unit = "" if i.unit in ("", "1") else f" {i.unit}"
    lost = f", {sum(i.missing.values())} cases without a value" if i.missing else ""
    return f"{i.mean.value:.4g} ± {i.deviation.value:.2g}{unit}{lost}"


def _bars(axes: Axes, at: np.ndarray, found: Sequence[Estimate], color: str, label: str) -> None:
    there = [(y, e.value, e.low, e.high) for y, e in zip(at, found, strict=True) if e.value is not None]
    values: Any = np.array(there, float).reshape(-1, 4).T
    height = 0.36 if label.startswith(("alone", "with")) else 0.5
    axes.barh(values[0], values[1], height, color=color, alpha=0.75, label=label)
    axes.errorbar(values[1], values[0], xerr=np.abs(values[2:] - values[1]), fmt="none", ecolor=INK, elinewidth=1.1, capsize=3)


def draw_histograms(values: Mapping[str, np.ndarray], found: Sequence[Spread]) -> Figure:
    """Draw a panel for each result, with histogram, quantiles with their intervals, and shares above bounds. values: {result: its
    values}."""
    chosen = list(found[:MOST_PANELS])
    fig, panels = make_panels(len(chosen), 2, (6.2, 3.4))
    for axes, s in zip(panels, chosen, strict=True):
        known = values[s.of]
        if len(known):
            axes.hist(known, min(BINS, max(8, int(np.sqrt(len(known))))), color=COLORS[5], alpha=0.8)
        for p, e in s.quantiles:
            _line(axes, e, f"{100 * p:g} %")
        for bound, e in s.above:
            axes.axvline(bound, color=COLORS[1], linestyle=(0, (4, 1.6)))
            axes.annotate(f"above: {_share(e)}", (bound, 0.82), xycoords=("data", "axes fraction"), fontsize=8, color=COLORS[1])
        axes.set_xlabel(with_unit(s.of, s.unit), fontsize=9)
        axes.set_ylabel("cases", fontsize=9)
        axes.set_title(f"{s.cases - s.missing} cases" + (f", {s.missing} without a value" if s.missing else ""), fontsize=9)
        axes.grid(axis="y", color=GRID)
        axes.set_axisbelow(True)
    return fig


def _line(axes: Axes, e: Estimate, word: str) -> None:
    if e.value is None:
        return
    ends = axes.get_xlim()
    low, high = ends[0] if e.low is None else e.low, ends[1] if e.high is None else e.high
    axes.set_xlim(ends)
    axes.axvspan(low, high, color=EVENT, alpha=0.3, linewidth=0)
    axes.axvline(e.value, color=INK, linewidth=1.0)
    axes.annotate(word, (e.value, 0.95), xycoords=("data", "axes fraction"), fontsize=8, ha="left")


def _share(e: Estimate) -> str:
    if e.value is None or e.low is None or e.high is None:
        return "?"
    return f"{100 * e.value:.3g} % ({100 * e.low:.2g} to {100 * e.high:.2g})"
