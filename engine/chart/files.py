"""A study as files: ``chart.svg``, ``chart.png``, ``chart.html``, ``chart.csv``."""

from __future__ import annotations

import os
from pathlib import Path

from engine.basics.files import writing
from engine.basics.problems import Problem, SceneError
from engine.chart.curves import verdict
from engine.chart.figure import figure
from engine.chart.page import page
from engine.chart.points import write_table
from engine.chart.study import Study
from engine.plots.files import save_figure, small


def folder_of(path: str | os.PathLike[str]) -> Path:
    """The folder to write in, created when it is missing; SceneError when it cannot be."""
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as e:
        raise SceneError([Problem("-o", f"the folder {os.fspath(path)!r} cannot be made: {e.strerror}", "choose another")]) from e
    if not os.access(folder, os.W_OK):
        raise SceneError([Problem("-o", f"the folder {os.fspath(path)!r} cannot be written", "choose another")])
    return folder


def write(study: Study, folder: str | os.PathLike[str]) -> list[Path]:
    """Write all four files into a folder (created when missing) and return their paths; SceneError when that is impossible."""
    target = folder_of(folder)
    drawn = figure(study)
    out = [save_figure(drawn, target / "chart.svg"), small(save_figure(drawn, target / "chart.png", dpi=100))]
    with writing(target / "chart.html", (".html",)) as work:
        work.write_text(page(study), encoding="utf-8")
    return [*out, target / "chart.html", write_table(study.points, target / "chart.csv", notes(study))]


def reference_lines(study: Study) -> list[str]:
    """A line for each reference solution: how it was made, and its own error."""
    both = [(f" ({v})" if v.law else "", r) for v, r in study.references.items()]
    return [f"reference{law}: {r.made_by}, which differ by {r.error:.1e}" for law, r in both]


def notes(study: Study) -> list[str]:
    """What a reader of the numbers must know, as lines: machine, scene, what was compared, how."""
    lines = [f"scene: {study.scene.name}, 0 to {study.until:g} s", f"error: {study.measure.describe()}"]
    lines += reference_lines(study)
    lines += [f"model_error is measured against: {study.exact}"] if study.exact.law else []
    lines += [f"building, once a structure, not in the times: {what} {seconds:.3g} s" for what, seconds in study.builds]
    lines += [f"peer {name} {version}: {text}" for name, version, text in study.peers]
    lines += [f"verdict: {v}" for v in verdict(study)]
    return lines + study.notes + [", ".join(f"{k}: {v}" for k, v in study.machine.items())]
