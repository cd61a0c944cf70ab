"""The work-precision diagram as a figure, with panels for methods, friction laws and reference solvers. Crosses mark failed
runs."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from trunnion.analysis.work_precision.error_cost_curves import Curve, group_into_curves
from trunnion.analysis.work_precision.measurement_points import Measurement, pareto_front
from trunnion.analysis.work_precision.request_and_results import WorkPrecision
from trunnion.plots.style.palette import GRID, INK, color

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MARKS = ("o", "s", "^", "D", "v", "P", "X", "*", "<", ">")
PANEL = (5.6, 4.6)
"""Width and height of a panel, inches."""
FAILED = 30.0
"""Crosses of failed runs are drawn at this multiple of the largest error shown."""


def draw_work_precision(study: WorkPrecision) -> Figure:
    """The figure. Its panels show methods with the exact law, friction laws by their error against the exact law, and reference
    solvers."""
    from matplotlib.figure import Figure

    panels = [("methods", group_into_curves([p for p in study.engine_points() if p.variant == study.exact]), False)]
    if len({p.variant for p in study.engine_points()}) > 1:
        panels.append(("friction laws, against " + str(study.exact), _law_curves(study), True))
    if study.solver_points():
        panels.append(("other programs, the best of each", _solver_curves(study), False))
    fig = Figure(figsize=(PANEL[0] * len(panels), PANEL[1] + 1.3), facecolor="white")
    for k, (title, chosen, model) in enumerate(panels):
        axes = fig.add_axes(((k + 0.13) / len(panels), 0.155, 0.84 / len(panels), 0.66))
        _draw_panel(axes, title, chosen, model, study)
    _draw_titles(fig, study)
    return fig


def _law_curves(study: WorkPrecision) -> list[Curve]:
    """A curve for every law with the automatic choice of method. If the automatic choice was not measured, a curve for every law
    and method."""
    controlled = [p for p in study.engine_points() if not p.fixed]
    return group_into_curves([p for p in controlled if p.method == "auto"] or controlled)


def _solver_curves(study: WorkPrecision) -> list[Curve]:
    """The engine's Pareto front for every law that a solver can handle, then each solver's Pareto front. (The HTML page shows all
    points.)"""
    out = []
    for v in dict.fromkeys(p.variant for p in study.solver_points()):
        best = pareto_front(p for p in study.engine_points() if p.variant == v)
        name = "trunnion, best of all" + (f" ({v})" if v.law else "")
        out.append(Curve("", name, v.law, v.v_eps, False, tuple(best)))
    for program in dict.fromkeys(p.program for p in study.solver_points()):
        mine = [p for p in study.solver_points() if p.program == program]
        best = [p for p in pareto_front(mine) if p.error < 10]
        bad = [p for p in mine if not p.ok]
        out.append(Curve(program, "", mine[0].law, mine[0].v_eps, False, tuple(best + bad)))
    return out


def _draw_panel(axes: Axes, title: str, chosen: Iterable[Curve], model: bool, study: WorkPrecision) -> None:
    from matplotlib.ticker import FuncFormatter

    shown = list(chosen)
    edge = FAILED * max((e for c in shown for p in c.points if p.ok and (e := _shown_error(p, model)) > 0), default=1.0)
    hues: dict[tuple, int] = {}
    for c in shown:
        hue = hues.setdefault((c.program, c.method, *((c.law, c.v_eps) if model else ())), len(hues))
        _draw_curve(axes, c, hue, model, edge)
    axes.set_xscale("log")
    axes.set_yscale("log")
    own = study.references.get(study.exact)
    if own and own.error > 0:
        axes.axvline(own.error, color="#999999", lw=0.8, ls=":", zorder=0.5)
        axes.text(own.error, 0.985, " the reference's own error", rotation=90, size=6.5, color="#777777", va="top", ha="right",
                  transform=axes.get_xaxis_transform())
    if any(not p.ok for c in shown for p in c.points):
        axes.axvspan(edge / 3, edge * 6, color="#f6eeee", zorder=0.2)
        axes.text(edge, 0.985, "failed", size=7.5, color="#B00020", va="top", ha="center", transform=axes.get_xaxis_transform())
    axes.yaxis.set_major_formatter(FuncFormatter(lambda t, _: f"{t:g}"))
    axes.yaxis.set_minor_formatter(FuncFormatter(lambda t, _: _minor_label(axes, t)))
    axes.set_title(title, size=10, loc="left", color=INK)
    axes.set_xlabel("error (relative)" if not model else "error against the exact law (relative)", size=8.5)
    axes.set_ylabel(f"stepping time, ms (minimum of {study.request.repeats})", size=8.5)
    axes.grid(True, which="major", color=GRID, lw=0.6)
    axes.tick_params(which="both", labelsize=8)
    axes.legend(fontsize=6.5, loc="best", framealpha=0.85, ncol=1 if len(shown) < 9 else 2, handlelength=2.2)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def _minor_label(axes: Axes, t: float) -> str:
    """Label of 2 and 5 times a power of ten if the axis spans few decades; else ""."""
    low, high = axes.get_ylim()
    return f"{t:g}" if high / low < 300 and round(t / 10.0 ** math.floor(math.log10(t))) in (2, 5) else ""


def _shown_error(p: Measurement, model: bool) -> float:
    return p.model_error if model else p.error


def _draw_curve(axes: Axes, c: Curve, i: int, model: bool, edge: float) -> None:
    """Draw one curve. A cross at abscissa ``edge`` marks a failed run; its ordinate is the time until the failure."""
    good = [p for p in c.points if p.ok and _shown_error(p, model) > 0]
    bad = [p for p in c.points if not p.ok and p.minimum > 0]
    best = c.program == ""
    label = f"{c.law_label} ({c.method})" if model else c.label
    look: dict[str, Any] = {"color": "black" if best else color(i), "ls": "--" if c.fixed and not best else "-", "ms": 3.6}
    axes.plot([_shown_error(p, model) for p in good], [1e3 * p.minimum for p in good], marker=MARKS[i % len(MARKS)],
              lw=2.4 if best else 1.1, label=label, mfc="white" if c.fixed else None, **look)
    for p in good if not model else ():
        if p.predicted > 0:
            axes.plot([p.error, p.predicted], [1e3 * p.minimum] * 2, color=look["color"], lw=0.6, marker="|", ms=3.5, markevery=[1])
    for p in bad:
        axes.plot([edge * 1.15 ** (i - 4)], [1e3 * p.minimum], marker="x", color=look["color"], ms=4.5, ls="")


def _draw_titles(fig: Any, study: WorkPrecision) -> None:
    height = fig.get_figheight()
    scene = study.scene
    fig.text(0.012, 1 - 0.24 / height, f"{scene.title or scene.name}: error against time", size=13, weight="bold", color=INK)
    own = study.references.get(study.exact)
    words = [f"0–{study.until:g} s", study.measure.describe()]
    lines = [" · ".join(words)]
    if own:
        lines.append(f"reference: {own.made_by}, whose results differ by {own.error:.1e}")
    if any(p.predicted > 0 for p in study.points):
        lines[-1] += " · |: the run's own error estimate"
    lines[-1] += f" · {study.machine['processor']}, one core"
    for k, line in enumerate(lines):
        fig.text(0.012, 1 - (0.46 + 0.19 * k) / height, line, size=7.5, color="#555555")
    build = " · ".join(f"{what} {seconds:.2g} s" for what, seconds in study.builds if not math.isnan(seconds))
    fig.text(0.012, 0.16 / height, f"building, once for each structure, not included: {build}", size=7.5, color="#555555")
