"""Panels and labels that several figures share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def make_panels(count: int, columns: int, size: tuple[float, float], **look: Any) -> tuple[Figure, list[Axes]]:
    """A figure with a grid of panels in at most ``columns`` columns. size: width and height of a panel, inches. look: arguments of
    each panel's axes."""
    from matplotlib.figure import Figure

    columns = max(1, min(columns, count))
    rows = max(1, -(-count // columns))
    fig = Figure(figsize=(size[0] * columns, size[1] * rows), facecolor="white", layout="constrained")
    return fig, [fig.add_subplot(rows, columns, i + 1, **look) for i in range(count)]


def with_unit(name: str, unit: str) -> str:
    """A name, followed by its unit in parentheses, if there is a unit."""
    return name if unit in ("", "1") else f"{name} ({unit})"


def shorten_paths(paths: Sequence[str]) -> dict[str, str]:
    """{path: short name}. The short name is the last n parts of the path. n is the smallest number that makes all short names
    different."""
    parts = {p: p.split(".") for p in paths}
    for n in range(1, max(map(len, parts.values())) + 1):
        short = {p: ".".join(x[-n:]) for p, x in parts.items()}
        if len(set(short.values())) == len(short):
            return short
    return {p: p for p in paths}
