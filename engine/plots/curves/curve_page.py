"""The page of curves of a run: layout and drawing of the sections of ``panel_selection``."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.plots.curves.error_bands import errors
from trunnion.plots.curves.panel_selection import Panel, Section, sections
from trunnion.plots.style.captions import caption
from trunnion.plots.style.palette import EVENT, GRID, INK, color, dash

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from trunnion.simulation.results.result import Result

WIDTH, HEIGHT = 5.2, 2.05
"""Width and height of one panel, inches."""
LEFT, RIGHT, TOP, BOTTOM = 0.85, 0.25, 0.95, 0.65
GAP_X, GAP_Y, HEADING = 0.85, 0.62, 0.42
TALL = 9
"""Largest number of rows of a page with two columns. A longer page has three columns."""
FEW_EVENTS, MANY_EVENTS = 20, 120
"""If there are more than ``FEW_EVENTS`` events, event lines are fainter. At most ``MANY_EVENTS`` events are drawn."""
TITLE_LINE = 46
"""Number of characters of labels that fit beside a panel's title. A legend with more characters is drawn inside the axes."""


def figure(result: Result, joints: Sequence[str] | None = None, between: tuple[float, float] | None = None) -> Figure:
    """A page of curves: friction, accelerations, contact angles and normal forces of joints, then motion and energy.

    Reversals of sliding are thin vertical lines. At each reversal, the contact angle jumps from ○ to ●. joints: names of the joints
    to draw (default: the first joints with friction). between: the part of the run to show, s. """
    shown = window(result, between) if between else result
    return page(shown, sections(shown, joints), between)


def page(result: Result, parts: list[Section], between: tuple[float, float] | None = None) -> Figure:
    """Draw sections of panels as one page."""
    from matplotlib.figure import Figure

    count = sum(len(s.panels) for s in parts)
    columns = 1 if count < 2 else 2 if sum(-(-len(s.panels) // 2) for s in parts) <= TALL else 3
    height, places = _layout(parts, columns)
    width = LEFT + columns * WIDTH + (columns - 1) * GAP_X + RIGHT
    fig = Figure(figsize=(width, height), facecolor="white")
    _titles(fig, result, width, height)
    scale, unit = (1e3, "ms") if len(result) and result.time[-1] < 0.1 else (1.0, "s")
    for section, top, boxes in places:
        fig.text(LEFT / width, top / height, section.heading, size=11, weight="bold", color=INK, va="center")
        for panel, (x, y) in zip(section.panels, boxes, strict=True):
            axes = fig.add_axes((x / width, y / height, WIDTH / width, HEIGHT / height))
            span = between or (0.0, result.settings.get("until") or result.time[-1])
            _draw(axes, panel, scale, unit, span)
            if result.certainty is not None:
                errors(axes, panel, scale, thousands(panel), min(result.certainty.promise.until, span[1]))
    if not count:
        fig.text(0.5, 0.4, "no columns to draw (see the outputs patterns)", ha="center", color=INK)
    return fig


def window(result: Result, between: tuple[float, float]) -> Result:
    """The rows and events of a result within a span of time."""
    first, last = between
    rows = (result.time >= first) & (result.time <= last)
    here = [i for i, e in enumerate(result.events) if first <= e.time <= last]
    certainty = result.certainty and result.certainty.within(rows, here)
    return replace(result, data=result.data[rows], events=tuple(result.events[i] for i in here), certainty=certainty)


def _layout(parts: list[Section], columns: int) -> tuple[float, list[tuple[Section, float, list[tuple[float, float]]]]]:
    """(height of the page, [(section, y of its heading, corners of its panels)]), in inches from the lower left."""
    rows = [-(-len(s.panels) // columns) for s in parts]
    height = TOP + sum(HEADING + n * (HEIGHT + GAP_Y) for n in rows) - GAP_Y + BOTTOM if parts else 2.0
    y, places = height - TOP, []
    for section, n in zip(parts, rows, strict=True):
        top = y - 0.1
        y -= HEADING
        boxes = [
            (LEFT + (i % columns) * (WIDTH + GAP_X), y - HEIGHT - (i // columns) * (HEIGHT + GAP_Y))
            for i in range(len(section.panels))
        ]
        places.append((section, top, boxes))
        y -= n * (HEIGHT + GAP_Y)
    return height, places


def _titles(fig: Any, result: Result, width: float, height: float) -> None:
    scene = result.scene
    fig.text(LEFT / width, 1 - 0.3 / height, scene.title or scene.name, size=14, weight="bold", color=INK, va="center")
    fig.text(LEFT / width, 1 - 0.6 / height, caption(result), size=9, color="#555555", va="center")


def _draw(axes: Axes, panel: Panel, scale: float, unit: str, span: tuple[float, float]) -> None:
    """Draw one panel: event lines, curves, jumps, labels."""
    faint = min(1.0, max(0.3, FEW_EVENTS / max(1, len(panel.events))))
    for e in panel.events[:: max(1, -(-len(panel.events) // MANY_EVENTS))]:
        axes.axvline(e.time * scale, color=EVENT, lw=0.5, alpha=faint, zorder=0.5)
    several, power = len(panel.curves) > 1, thousands(panel)
    for i, c in enumerate(panel.curves):
        width = 2.3 if several and i == 0 else 1.3
        axes.plot(c.time * scale, c.values / 10.0**power, color=color(i), ls=dash(i), lw=width, label=_label(panel, c.label))
    size = 4.0 if len(panel.jumps) <= FEW_EVENTS else 2.2
    for i, at, before, after in panel.jumps[:: max(1, len(panel.jumps) // MANY_EVENTS)]:
        axes.plot([at * scale], [before], "o", ms=size, mfc="white", mec=color(i), mew=0.9, zorder=3)
        axes.plot([at * scale], [after], "o", ms=size, color=color(i), zorder=3)
    _dress(axes, panel, unit, power)
    axes.set_xlim(span[0] * scale, span[1] * scale)


def thousands(panel: Panel) -> int:
    """Power of ten (multiple of three) by which values are divided, so that the numbers at the axis are short."""
    tops = [float(np.max(np.abs(c.values[np.isfinite(c.values)]), initial=0.0)) for c in panel.curves]
    top = max(tops, default=0.0)
    return 0 if panel.unit == "°" or top == 0.0 or 1e-2 <= top < 1e5 else 3 * math.floor(math.log10(top) / 3)


def ylabel(panel: Panel, power: int) -> str:
    """Label of the vertical axis: quantity and unit, with the power of ten."""
    raised = f"{power}".translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return f"{panel.quantity}, 10{raised} {panel.unit}" if power else f"{panel.quantity}, {panel.unit}"


def _label(panel: Panel, column: str) -> str:
    """The name of a column, without the joint in the title of the panel and without the ending of contact columns."""
    owner, _, rest = column.partition(".")
    short = rest if rest and panel.title.endswith(f" {owner}") else column
    for ending in (".normal_force", ".angle"):
        short = short.removesuffix(ending)
    return short


def _dress(axes: Axes, panel: Panel, unit: str, power: int) -> None:
    """Draw a panel's titles, grid, axes and legend."""
    from matplotlib.ticker import MaxNLocator

    axes.set_title(panel.title, size=9.5, loc="left", color=INK, pad=5)
    axes.set_xlabel(f"time, {unit}", size=8.5, labelpad=1)
    axes.set_ylabel(ylabel(panel, power), size=8.5)
    axes.tick_params(labelsize=8, length=3)
    axes.grid(True, color=GRID, lw=0.6)
    axes.set_axisbelow(True)
    axes.margins(y=0.1)
    axes.ticklabel_format(axis="y", style="plain", useOffset=False)
    if panel.quantity == "contact angle":
        axes.yaxis.set_major_locator(MaxNLocator(nbins=6, steps=[1, 1.5, 3, 4.5, 6, 9, 10]))
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    _legend(axes, panel)


def _legend(axes: Axes, panel: Panel) -> None:
    """Write the names of the curves beside the title if they fit, else inside the panel."""
    labels = [_label(panel, c.label) for c in panel.curves]
    title = f"and {panel.hidden} more" if panel.hidden else None
    beside = len(panel.title) + sum(len(t) + 6 for t in labels) <= 2 * TITLE_LINE and not title
    look: dict[str, Any] = {"fontsize": 7.5, "handlelength": 2.4, "borderpad": 0.2, "title": title, "title_fontsize": 7}
    if beside:
        look |= {"loc": "lower right", "bbox_to_anchor": (1.01, 0.985), "ncol": len(labels), "frameon": False}
        axes.legend(columnspacing=1.1, handletextpad=0.5, **look)
    else:
        axes.legend(loc="best" if len(panel.curves[0].time) < 3000 else "upper right", framealpha=0.85, **look)
