"""Pictures of studies: convergence of an optimisation, and boundaries where a result jumps or an outcome changes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.plots.style.palette import COLORS, EVENT, GRID, INK
from trunnion.plots.style.panels_and_labels import shorten_paths, with_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from trunnion.batch.sweep import Sweep

MARKS = ("o", "X", "s", "^", "D", "v", "P", "*")
"""Marks of outcomes, in their order."""


def _figure(height: float) -> Figure:
    from matplotlib.figure import Figure

    return Figure(figsize=(8.0, height), facecolor="white", layout="constrained")


def draw_convergence(answer: Mapping[str, Any], sweep: Sweep) -> Figure:
    """Draw the result of each case in the order of the runs, the best result so far, and the tried values of each number."""
    paths, of = sweep.plan.cases.paths, answer["of"]
    fig = _figure(3.2 + 1.3 * len(paths))
    panels: Any = fig.subplots(1 + len(paths), 1, sharex=True, squeeze=False)[:, 0]
    outcomes, case = np.array(sweep.table["outcome"].to_pylist(), object), sweep.table["case"].to_numpy()
    values = np.where(outcomes == "done", sweep.table[of].to_numpy().astype(float), np.nan)
    top = panels[0]
    top.plot(case, values, "o", color=COLORS[5], markersize=3, label="every case")
    path = [(p["case"], p["value"]) for p in answer["path"] if p["value"] is not None]
    if path:
        x, y = (list(c) for c in zip(*path, strict=True))
        top.step([*x, len(case) - 1], [*y, y[-1]], where="post", color=COLORS[1], linewidth=1.6, label="best so far")
        low, high = np.nanpercentile(values, [1, 90])
        top.set_ylim(min(low, min(y)) - 0.05 * (high - low), max(high, max(y[-1:])) + 0.05 * (high - low))
    if answer["target"] is not None:
        top.axhline(answer["target"], color=INK, linewidth=0.8, linestyle=(0, (4, 1.6)), label="target")
    top.set_ylabel(_result_label(of, sweep), fontsize=8)
    top.set_title(f"{answer['goal']} {of}: {answer['why']}", fontsize=9)
    top.legend(fontsize=8, frameon=False)
    short, columns = shorten_paths(paths), sweep.table
    for axes, path_ in zip(panels[1:], paths, strict=True):
        number = next(n for n in answer["numbers"] if n["path"] == path_)
        axes.plot(case, columns[path_].to_numpy(), ".", color=COLORS[0], markersize=3)
        axes.axhline(number["value"], color=COLORS[1], linewidth=1.0)
        axes.set_ylabel(with_unit(short[path_], number["unit"]), fontsize=8)
    panels[-1].set_xlabel("case", fontsize=9)
    for axes in panels:
        axes.grid(color=GRID)
    return fig


def _result_label(of: str, sweep: Sweep) -> str:
    return with_unit(of, next((r.unit for r in sweep.plan.reductions if r.name == of), "1"))


def draw_refinement(answer: Mapping[str, Any], sweep: Sweep) -> Figure:
    """Draw the cases over one number and the result, or over two numbers. Outcomes have colours and marks. Boundaries are
    shaded."""
    paths, of = sweep.plan.cases.paths, answer["of"]
    fig = _figure(4.5 if len(paths) == 1 else 6.0)
    axes = fig.add_subplot()
    table = sweep.table.sort_by(paths[0])
    outcomes = np.array(table["outcome"].to_pylist(), object)
    x = table[paths[0]].to_numpy()
    if len(paths) > 1:
        up, label = table[paths[1]].to_numpy(), _number_label(answer, 1)
    elif of == "outcome":
        up, label = np.zeros(len(x)), ""
    else:
        up, label = table[of].to_numpy().astype(float), _result_label(of, sweep)
        up = np.where(np.isnan(up), np.nanmin(up) - 0.04 * np.ptp(up[~np.isnan(up)]), up)  # drawn lowest: cases without a result
    for k, outcome in enumerate(dict.fromkeys(["done", *outcomes.tolist()])):
        here = outcomes == outcome
        mark, color = MARKS[k % len(MARKS)], COLORS[k % len(COLORS)]
        axes.plot(x[here], up[here], mark, color=color, markersize=4, label=outcome.replace("_", " "))
    _boundaries(axes, answer, len(paths))
    axes.set_xlabel(_number_label(answer, 0), fontsize=9)
    axes.set_ylabel(label, fontsize=9)
    if not label:
        axes.set_yticks([])
    axes.legend(fontsize=8, frameon=False)
    axes.grid(color=GRID)
    return fig


def _number_label(answer: Mapping[str, Any], k: int) -> str:
    return with_unit(answer["paths"][k], answer["units"][k])


def _boundaries(axes: Axes, answer: Mapping[str, Any], dimensions: int) -> None:
    from matplotlib.patches import Rectangle

    for b in answer["boundaries"]:
        if dimensions == 1:
            axes.axvspan(b["low"][0], b["high"][0], color=EVENT, alpha=0.5)
        else:
            size = b["high"][0] - b["low"][0], b["high"][1] - b["low"][1]
            axes.add_patch(Rectangle((b["low"][0], b["low"][1]), *size, facecolor=EVENT, alpha=0.4, linewidth=0))
