"""Writes the files of a measurement: ``chart.svg``, ``chart.png``, ``chart.html``, ``chart.csv``."""

from __future__ import annotations

import os
from pathlib import Path

from trunnion.analysis.work_precision.error_cost_curves import compare_with_solvers
from trunnion.analysis.work_precision.figure import draw_work_precision
from trunnion.analysis.work_precision.html_page import make_page
from trunnion.analysis.work_precision.measurement_points import write_table
from trunnion.analysis.work_precision.request_and_results import WorkPrecision
from trunnion.basics.atomic_files import writing
from trunnion.basics.errors import Problem, SceneError
from trunnion.plots.style.figure_files import reduce_colours, save_figure


def make_folder(path: str | os.PathLike[str]) -> Path:
    """The folder ``path``, which is created if it is missing. Raises SceneError if the folder cannot be created or written."""
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as e:
        raise SceneError([Problem("-o", f"the folder {os.fspath(path)!r} cannot be made: {e.strerror}", "choose another")]) from e
    if not os.access(folder, os.W_OK):
        raise SceneError([Problem("-o", f"the folder {os.fspath(path)!r} cannot be written", "choose another")])
    return folder


def write_work_precision(study: WorkPrecision, folder: str | os.PathLike[str]) -> list[Path]:
    """Write all four files into a folder (a missing folder is created); returns the paths. Raises SceneError for an unusable
    folder."""
    target = make_folder(folder)
    drawn = draw_work_precision(study)
    out = [save_figure(drawn, target / "chart.svg"), reduce_colours(save_figure(drawn, target / "chart.png", dpi=100))]
    with writing(target / "chart.html", (".html",)) as work:
        work.write_text(make_page(study), encoding="utf-8")
    return [*out, target / "chart.html", write_table(study.points, target / "chart.csv", study_notes(study))]


def reference_lines(study: WorkPrecision) -> list[str]:
    """A line for each reference solution: its two methods and the distance between their results."""
    both = [(f" ({v})" if v.law else "", r) for v, r in study.references.items()]
    return [f"reference{law}: {r.made_by}, whose results differ by {r.error:.1e}" for law, r in both]


def study_notes(study: WorkPrecision) -> list[str]:
    """Lines that describe the measurement: machine, scene, compared columns, references."""
    lines = [f"scene: {study.scene.name}, 0 to {study.until:g} s", f"error: {study.measure.describe()}"]
    lines += reference_lines(study)
    lines += [f"model_error is measured against: {study.exact}"] if study.exact.law else []
    lines += [
        f"building, once for each structure, not included in the times: {what} {seconds:.3g} s" for what, seconds in study.builds
    ]
    lines += [f"peer {name} {version}: {text}" for name, version, text in study.solvers]
    lines += [f"verdict: {v}" for v in compare_with_solvers(study)]
    return lines + study.notes + [", ".join(f"{k}: {v}" for k, v in study.machine.items())]
