"""Pictures of results: curves (``figure``), the mechanism at an instant (``mechanism``), in motion (``animate``; ``view`` in a
notebook)."""

from engine.plots.animate import animate
from engine.plots.curves import figure
from engine.plots.files import save_figure
from engine.plots.mechanism import mechanism
from engine.plots.view import view

__all__ = ["animate", "figure", "mechanism", "save_figure", "view"]
