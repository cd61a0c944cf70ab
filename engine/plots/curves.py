"""The page of curves of a run: ``figure(result)`` lays out what ``panels`` chose."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from engine.plots.palette import EVENT, GRID, INK, color, dash
from engine.plots.panels import Panel, Section, frictional, sections

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from engine.simulate.result import Result

WIDTH, HEIGHT = 5.2, 2.05
"""Inches of one panel."""
LEFT, RIGHT, TOP, BOTTOM = 0.85, 0.25, 0.95, 0.65
GAP_X, GAP_Y, HEADING = 0.85, 0.62, 0.42
WIDE = 9
"""Panels from which the page has three columns."""
MANY_EVENTS = 80
"""More event lines than this would hide the curves; only so many are drawn, evenly chosen."""


def figure(result: Result, joints: Sequence[str] | None = None) -> Figure:
    """A page of curves: for each frictional joint (or those named) friction, accelerations, contact angles and normal forces,
    then the motion and the energy. Reversals of sliding are thin vertical lines; at each the contact angle jumps from ○ to ●.
    """
    from matplotlib.figure import Figure

    parts = sections(result, joints)
    count = sum(len(s.panels) for s in parts)
    columns = 1 if count < 2 else 2 if count < WIDE else 3
    height, places = _layout(parts, columns)
    width = LEFT + columns * WIDTH + (columns - 1) * GAP_X + RIGHT
    fig = Figure(figsize=(width, height), facecolor="white")
    _titles(fig, result, width, height)
    scale, unit = (1e3, "ms") if len(result) and result.time[-1] < 0.1 else (1.0, "s")
    for section, top, boxes in places:
        fig.text(LEFT / width, top / height, section.heading, size=11, weight="bold", color=INK, va="center")
        for panel, (x, y) in zip(section.panels, boxes, strict=True):
            axes = fig.add_axes((x / width, y / height, WIDTH / width, HEIGHT / height))
            _draw(axes, panel, scale, unit, result.settings.get("until"))
    if not count:
        fig.text(0.5, 0.4, "no columns to draw (see the outputs patterns)", ha="center", color=INK)
    return fig


def _layout(parts: list[Section], columns: int) -> tuple[float, list[tuple[Section, float, list[tuple[float, float]]]]]:
    """(height, [(section, y of its heading, corners of its panels)]) in inches from the lower left."""
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


def caption(result: Result) -> str:
    """What the numbers depend on: friction laws with their regularisation, method, tolerance, outcome."""
    scene, used = result.scene, result.settings
    laws = {scene.joints[j].friction.law or scene.friction.law for j in frictional(result)}  # type: ignore[union-attr]
    words = [f"friction law {', '.join(sorted(laws))}"] if laws else []
    if "regularized" in laws:
        words.append(f"v_eps {float(scene.friction.v_eps):g} m/s")
    words.append(f"method {used.get('method', '?')}")
    words.append(f"fixed step {used['step']:g} s" if used.get("step") else f"rtol {used.get('rtol', 0):g}")
    name = result.outcome.name.replace("_", " ")
    where = f" in {result.outcome.joint}" if result.outcome.joint else ""
    return " · ".join([*words, f"{name}{where} at t = {result.outcome.time:.6g} s"])


def _draw(axes: Axes, panel: Panel, scale: float, unit: str, until: float | None) -> None:
    """One panel: event lines, curves, jumps, labels."""
    for at in _thinned([e.time for e in panel.events]):
        axes.axvline(at * scale, color=EVENT, lw=0.5, zorder=0.5)
    few = len(panel.curves) > 1
    for i, c in enumerate(panel.curves):
        axes.plot(c.time * scale, c.values, color=color(i), ls=dash(i), lw=1.3 + 0.5 * (few and i == 0), label=c.label)
    for i, at, before, after in panel.jumps[:: max(1, len(panel.jumps) // MANY_EVENTS)]:
        axes.plot([at * scale], [before], "o", ms=4, mfc="white", mec=color(i), mew=0.9, zorder=3)
        axes.plot([at * scale], [after], "o", ms=4, color=color(i), zorder=3)
    _dress(axes, panel, unit)
    if until:
        axes.set_xlim(0, until * scale)


def _dress(axes: Axes, panel: Panel, unit: str) -> None:
    """Titles, grid, legend."""
    from matplotlib.ticker import MaxNLocator

    axes.set_title(panel.title, size=9.5, loc="left", color=INK, pad=4)
    axes.set_xlabel(f"time, {unit}", size=8.5, labelpad=1)
    axes.set_ylabel(panel.ylabel, size=8.5)
    axes.tick_params(labelsize=8, length=3)
    axes.grid(True, color=GRID, lw=0.6)
    axes.set_axisbelow(True)
    axes.margins(y=0.12)
    axes.ticklabel_format(axis="y", style="sci", scilimits=(-3, 5), useMathText=True)
    axes.yaxis.get_offset_text().set_size(7.5)
    if panel.quantity == "contact angle":
        axes.yaxis.set_major_locator(MaxNLocator(nbins=6, steps=[1, 1.5, 3, 4.5, 6, 9, 10]))
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    if len(panel.curves) > 1 or panel.curves[0].label not in panel.title:
        title = f"and {panel.hidden} more" if panel.hidden else None
        axes.legend(fontsize=7, framealpha=0.85, title=title, title_fontsize=7, loc="best", handlelength=2.6, borderpad=0.3)


def _thinned(times: list[float]) -> list[float]:
    return times[:: max(1, -(-len(times) // MANY_EVENTS))]
