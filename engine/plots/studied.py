"""Pictures of studies: how the best came about, and where a result jumps or an outcome changes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from engine.plots.palette import COLORS, EVENT, GRID, INK
from engine.plots.sampled import shortened

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from engine.batch.sweeping import Sweep

MARKS = ("o", "X", "s", "^", "D", "v", "P", "*")
"""Of outcomes: each has a shape and a colour of its own."""


def _figure(height: float) -> Figure:
    from matplotlib.figure import Figure

    return Figure(figsize=(8.0, height), facecolor="white", layout="constrained")


def convergence(answer: Mapping[str, Any], sweep: Sweep) -> Figure:
    """The result of every case in the order in which they were run, the best so far, and where the numbers were looked for."""
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
        top.axhline(answer["target"], color=INK, linewidth=0.8, linestyle=(0, (4, 1.6)), label="to be reached")
    top.set_ylabel(_named(of, sweep), fontsize=8)
    top.set_title(f"{answer['goal']} {of}: {answer['why']}", fontsize=9)
    top.legend(fontsize=8, frameon=False)
    short, columns = shortened(paths), sweep.table
    for axes, path_ in zip(panels[1:], paths, strict=True):
        axes.plot(case, columns[path_].to_numpy(), ".", color=COLORS[0], markersize=3)
        axes.axhline(next(n["value"] for n in answer["numbers"] if n["path"] == path_), color=COLORS[1], linewidth=1.0)
        unit = next(n["unit"] for n in answer["numbers"] if n["path"] == path_)
        axes.set_ylabel(short[path_] + ("" if unit in ("", "1") else f" ({unit})"), fontsize=8)
    panels[-1].set_xlabel("case", fontsize=9)
    for axes in panels:
        axes.grid(color=GRID)
    return fig


def _named(of: str, sweep: Sweep) -> str:
    unit = next((r.unit for r in sweep.plan.reductions if r.name == of), "1")
    return of if unit in ("", "1") else f"{of} ({unit})"


def refined(answer: Mapping[str, Any], sweep: Sweep) -> Figure:
    """The cases over one number with the result upward, or over the first two; outcomes by colour and shape, boundaries shaded."""
    paths, of = sweep.plan.cases.paths, answer["of"]
    fig = _figure(4.5 if len(paths) == 1 else 6.0)
    axes = fig.add_subplot()
    table = sweep.table.sort_by(paths[0])
    outcomes = np.array(table["outcome"].to_pylist(), object)
    x = table[paths[0]].to_numpy()
    if len(paths) > 1:
        up, label = table[paths[1]].to_numpy(), _numbered(answer, 1)
    elif of == "outcome":
        up, label = np.zeros(len(x)), ""
    else:
        up, label = table[of].to_numpy().astype(float), _named(of, sweep)
        up = np.where(np.isnan(up), np.nanmin(up) - 0.04 * np.ptp(up[~np.isnan(up)]), up)  # along the lower end
    for k, outcome in enumerate(dict.fromkeys(["done", *outcomes.tolist()])):
        here = outcomes == outcome
        mark, color = MARKS[k % len(MARKS)], COLORS[k % len(COLORS)]
        axes.plot(x[here], up[here], mark, color=color, markersize=4, label=outcome.replace("_", " "))
    _boundaries(axes, answer, len(paths))
    axes.set_xlabel(_numbered(answer, 0), fontsize=9)
    axes.set_ylabel(label, fontsize=9)
    if not label:
        axes.set_yticks([])
    axes.legend(fontsize=8, frameon=False)
    axes.grid(color=GRID)
    return fig


def _numbered(answer: Mapping[str, Any], k: int) -> str:
    unit = answer["units"][k]
    return answer["paths"][k] + ("" if unit in ("", "1") else f" ({unit})")


def _boundaries(axes: Axes, answer: Mapping[str, Any], dimensions: int) -> None:
    from matplotlib.patches import Rectangle

    for b in answer["boundaries"]:
        if dimensions == 1:
            axes.axvspan(b["low"][0], b["high"][0], color=EVENT, alpha=0.5)
        else:
            size = b["high"][0] - b["low"][0], b["high"][1] - b["low"][1]
            axes.add_patch(Rectangle((b["low"][0], b["low"][1]), *size, facecolor=EVENT, alpha=0.4, linewidth=0))
