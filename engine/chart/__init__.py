"""Error against cost of a scene, for every method, tolerance and law: ``chart(scene)`` measures, ``write(study, folder)`` draws."""

from engine.chart.files import write
from engine.chart.study import Choice, Study, chart

__all__ = ["Choice", "Study", "chart", "write"]
