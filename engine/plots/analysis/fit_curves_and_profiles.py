"""Pictures of fits: measured curves and model curves with misfits, profiles of the parameters, and correlations."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.plots.style.palette import COLORS, EVENT, GRID, INK
from trunnion.plots.style.panels_and_labels import shorten_paths, with_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMNS = 3
WIDTH, CURVE, PROFILE = 9.0, 2.6, 2.5
ABOVE = 1.6
"""Profiles are drawn up to this rise, divided by the threshold."""
MOST = 6
"""Largest count of curves, and of profiles, that are drawn. The title states how many are left out."""


@dataclass(frozen=True)
class Compare:
    """A measured curve and the model's curve (n values each). time: s. noise: standard deviation of the measurement."""

    title: str
    unit: str
    time: np.ndarray
    measured: np.ndarray
    model: np.ndarray
    noise: float


@dataclass(frozen=True)
class Profile:
    """A parameter's profile.

    value: the estimate. deviation: the local standard deviation, or infinity. values, rises: points of the profile (k each). ends:
    both ends of the interval. kinds: their kinds. At an end of kind "found", the profile crosses the threshold.
    """

    path: str
    unit: str
    value: float
    deviation: float
    values: np.ndarray
    rises: np.ndarray
    ends: tuple[float, float]
    kinds: tuple[str, str]


def draw_fit(
    curves: Sequence[Compare], profiles: Sequence[Profile], names: Sequence[str], correlation: np.ndarray, rise: float, level: float
) -> Figure:
    """Draw curves with their misfits, profiles with the threshold ``rise`` of the given level, and the correlation of the
    parameters.

    correlation: m × m. The correlation is drawn only if there are several parameters.
    """
    from matplotlib.figure import Figure

    shown, drawn = curves[:MOST], profiles[:MOST]
    square = len(names) > 1
    panels = len(drawn) + square
    lines = -(-panels // COLUMNS)
    fig = Figure(figsize=(WIDTH, 0.3 + CURVE * len(shown) + PROFILE * lines), facecolor="white", layout="constrained")
    grid = fig.add_gridspec(len(shown) + lines, 6, height_ratios=[*[CURVE] * len(shown), *[PROFILE] * lines])
    for k, c in enumerate(shown):
        _curve(fig, grid[k, :].subgridspec(2, 1, height_ratios=(2.2, 1), hspace=0.05), c)
    short = shorten_paths([p.path for p in drawn] if len(drawn) == len(names) else list(names))
    for k in range(panels):
        axes = fig.add_subplot(grid[len(shown) + k // COLUMNS, 2 * (k % COLUMNS) : 2 * (k % COLUMNS) + 2])
        if k < len(drawn):
            _profile(axes, drawn[k], short[drawn[k].path], rise, level)
        else:
            _correlation(axes, [shorten_paths(list(names))[n] for n in names], correlation)
    left = len(curves) - len(shown) + len(profiles) - len(drawn)
    if left:
        fig.suptitle(f"{left} more curves or profiles are not drawn", fontsize=9, color=INK)
    return fig


def _curve(fig: Figure, place: Any, c: Compare) -> None:
    top = fig.add_subplot(place[0])
    low = fig.add_subplot(place[1], sharex=top)
    top.plot(c.time, c.measured, "o", ms=2.6, color=COLORS[5], label="measured")
    top.plot(c.time, c.model, color=COLORS[0], lw=1.3, label="model")
    top.set_title(c.title, fontsize=9, loc="left")
    top.set_ylabel(c.unit, fontsize=8)
    top.legend(fontsize=7, frameon=False, loc="best")
    top.tick_params(labelbottom=False)
    low.axhspan(-c.noise, c.noise, color=GRID, lw=0)
    low.axhline(0.0, color=INK, lw=0.6)
    low.plot(c.time, c.measured - c.model, ".", ms=3.0, color=COLORS[1])
    low.set_ylabel("misfit", fontsize=8)
    low.set_xlabel("time, s; grey: ± one standard deviation of the noise", fontsize=8)
    for axes in (top, low):
        _draw_grid(axes)


def _profile(axes: Axes, p: Profile, short: str, rise: float, level: float) -> None:
    """Draw a profile. The points are joined by lines that are straight in √rise, because √rise is nearly linear. The dashed curve
    is the local parabola."""
    inside = p.rises <= 4.0 * rise
    x, root = p.values[inside], np.sqrt(p.rises[inside]) * np.sign(p.values[inside] - p.value)
    fine = np.linspace(x[0], x[-1], 300) if len(x) > 1 else x
    axes.plot(fine, np.interp(fine, x, root) ** 2, color=COLORS[0], lw=1.3, label="profile")
    axes.plot(x, p.rises[inside], "o", ms=2.8, color=COLORS[0])
    if math.isfinite(p.deviation) and p.deviation > 0.0:
        axes.plot(fine, ((fine - p.value) / p.deviation) ** 2, color=EVENT, lw=1.0, ls=(0, (4, 1.6)), label="local")
    axes.axhline(rise, color=COLORS[1], lw=0.8)
    for end, kind in zip(p.ends, p.kinds, strict=True):
        axes.axvline(end, color=COLORS[1], lw=0.8, ls="-" if kind == "found" else ":")
    axes.set_ylim(-0.05 * rise, ABOVE * rise)
    if fine[-1] > fine[0]:
        axes.set_xlim(fine[0] - 0.05 * (fine[-1] - fine[0]), fine[-1] + 0.05 * (fine[-1] - fine[0]))
    axes.set_xlabel(with_unit(short, p.unit), fontsize=8)
    axes.set_ylabel(f"rise (line: {100 * level:g} % level)", fontsize=8)
    axes.locator_params(axis="x", nbins=4)
    axes.legend(fontsize=6.5, frameon=False, loc="upper center")
    _draw_grid(axes)


def _correlation(axes: Axes, names: Sequence[str], correlation: np.ndarray) -> None:
    axes.imshow(correlation, vmin=-1.0, vmax=1.0, cmap="RdBu_r")
    for (i, j), c in np.ndenumerate(correlation):
        said = f"{c:.3f}" if np.isfinite(c) else "–"
        axes.text(j, i, said, ha="center", va="center", fontsize=7, color="white" if abs(c) > 0.6 else INK)
    axes.set_xticks(range(len(names)), names, fontsize=6.5, rotation=30, ha="right")
    axes.set_yticks(range(len(names)), names, fontsize=6.5)
    axes.set_title("correlation", fontsize=8)


def _draw_grid(axes: Axes) -> None:
    axes.grid(color=GRID, lw=0.6)
    axes.tick_params(labelsize=7)
