"""The work-precision diagram as one self-contained HTML file."""

from __future__ import annotations

from pathlib import Path

from trunnion.analysis.work_precision.error_cost_curves import compare_with_solvers, group_into_curves
from trunnion.analysis.work_precision.request_and_results import WorkPrecision
from trunnion.plots.style.html_pages import make_html_page

VIEWER = Path(__file__).with_name("viewer")


def make_page(study: WorkPrecision) -> str:
    """The HTML text of the work-precision diagram."""
    data = page_data(study)
    return make_html_page(VIEWER / "chart.html", "chart.css", ("chart.js",), f"{data['title']}: error against time", data)


def page_data(study: WorkPrecision) -> dict:
    """Plain data of the page: curves with their points, references, build times, notes."""
    return {
        "title": study.scene.title or study.scene.name,
        "measure": study.measure.describe(),
        "until": study.until,
        "exact": str(study.exact),
        "curves": [
            {"label": c.label, "law": c.law_label, "program": c.program, "method": c.method, "fixed": c.fixed,
             "points": [_point_data(p) for p in c.points]}
            for c in group_into_curves(study.points)
        ],
        "references": [{"law": str(v), "made_by": r.made_by, "error": r.error} for v, r in study.references.items()],
        "builds": study.builds,
        "peers": study.solvers,
        "notes": study.notes,
        "verdict": compare_with_solvers(study),
        "machine": study.machine,
    }


def _point_data(p) -> dict:
    return {
        "setting": p.setting, "error": p.error, "model_error": p.model_error, "minimum": p.minimum, "median": p.median,
        "steps": p.steps, "rejected": p.rejected, "evaluations": p.evaluations, "events": p.events, "outcome": p.outcome,
        "repeats": p.repeats, "leaves_out": p.leaves_out, "predicted": p.predicted,
    }
