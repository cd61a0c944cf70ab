"""Pictures of results. ``figure`` draws curves, ``mechanism`` the mechanism at an instant, ``animate`` an animation, and ``view``
an animation in a notebook."""

from trunnion.plots.animation.html_or_film import animate
from trunnion.plots.animation.notebook_view import view
from trunnion.plots.curves.curve_page import figure
from trunnion.plots.mechanism_pictures.instant_picture import mechanism
from trunnion.plots.style.figure_files import save_figure

__all__ = ["animate", "figure", "mechanism", "save_figure", "view"]
