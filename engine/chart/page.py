"""The chart as one HTML file: points, style and script inside it, nothing fetched from anywhere."""

from __future__ import annotations

import html
import json
from pathlib import Path

from engine.chart.curves import curves, verdict
from engine.chart.study import Study
from engine.simulation.tables import finite

VIEWER = Path(__file__).with_name("viewer")


def page(study: Study) -> str:
    """The chart of a study as HTML text."""
    data = json.dumps(finite(content(study)), separators=(",", ":"), ensure_ascii=False).replace("<", "\\u003c")
    parts = {
        "title": html.escape(f"{study.scene.title or study.scene.name}: error against time"),
        "style": (VIEWER / "chart.css").read_text(encoding="utf-8"),
        "data": data,
        "script": (VIEWER / "chart.js").read_text(encoding="utf-8"),
    }
    pieces = (VIEWER / "chart.html").read_text(encoding="utf-8").split("{{")
    filled = [pieces[0]]
    for piece in pieces[1:]:
        key, _, rest = piece.partition("}}")
        filled += [parts[key], rest]
    return "".join(filled)


def content(study: Study) -> dict:
    """What the page shows: curves with their points, references, what was left out, build times."""
    return {
        "title": study.scene.title or study.scene.name,
        "measure": study.measure.describe(),
        "until": study.until,
        "exact": str(study.exact),
        "curves": [
            {"label": c.label, "law": c.law_label, "program": c.program, "method": c.method, "fixed": c.fixed,
             "points": [_point(p) for p in c.points]}
            for c in curves(study.points)
        ],
        "references": [{"law": str(v), "made_by": r.made_by, "error": r.error} for v, r in study.references.items()],
        "builds": study.builds,
        "peers": study.peers,
        "notes": study.notes,
        "verdict": verdict(study),
        "machine": study.machine,
    }


def _point(p) -> dict:
    return {
        "setting": p.setting, "error": p.error, "model_error": p.model_error, "minimum": p.minimum, "median": p.median,
        "steps": p.steps, "rejected": p.rejected, "evaluations": p.evaluations, "events": p.events, "outcome": p.outcome,
        "repeats": p.repeats, "leaves_out": p.leaves_out, "predicted": p.predicted,
    }
