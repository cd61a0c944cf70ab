"""Colours (Okabe and Ito) and line styles that colour-blind readers can tell apart."""

from __future__ import annotations

COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#7A6A00")
DASHES = ("-", (0, (4, 1.6)), (0, (1.2, 1.2)), (0, (6, 1.5, 1.2, 1.5)))
"""Line styles of matplotlib. Their gaps differ, so that two curves on top of each other are both visible."""
EVENT = "#8A8A8A"
GRID = "#E3E3E3"
INK = "#222222"
BODIES = ("#7FA8C9", "#E0B27A", "#8FBF9F", "#C7A0BE", "#D9D07A", "#A8A8B8", "#9CC5C9", "#D79A8B")
"""Colours of bodies without a colour in the scene, in the order of the scene."""
STATES = {1: ("#D55E00", "slipping +"), -1: ("#0072B2", "slipping −"), 0: ("#009E73", "proportional zone or stick")}
"""{friction state: (colour, words)}."""
OPEN = ("#9A9A9A", "no contact")
ARROW = "#B00020"
JOINT = "#6B6F76"
PRESSURE = ("#E9A43B", "#D8344F", "#9B3FD1")
"""Colours of the nominal pressure, from 0 to the largest pressure. The colours are visible on light and dark pages, and also differ
in lightness."""


def color(i: int) -> str:
    """Colour of the i-th curve."""
    return COLORS[i % len(COLORS)]


def dash(i: int) -> object:
    """Line style of the i-th curve."""
    return DASHES[i % len(DASHES)]


def hex_color(color: str) -> str:
    """The text #rrggbb for a colour's name. An unknown name gives the first colour of bodies."""
    if color.startswith("#") and len(color) == 7:
        return color
    from matplotlib.colors import to_hex

    try:
        return to_hex(color)
    except ValueError:
        return BODIES[0]
