"""A run that ``simulate`` or ``kinematics`` requests: its scene and settings, its files, its summary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trunnion.basics.errors import Problem
from trunnion.basics.interrupts import held
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.cli.options.argument_reader import PICTURES, TABLES, ArgumentReader
from trunnion.cli.output.exit_codes_and_errors import DONE, FAILED, print_json

if TYPE_CHECKING:
    from trunnion.scene.data_classes.scene import Scene
    from trunnion.simulation.results.result import Result

FILES = {
    "table": ("-o", TABLES),
    "plot": ("--plot", PICTURES),
    "animation": ("--animate", (".html", ".htm", ".gif", ".webp", ".mp4")),
    "linearization": ("--linearize", (".json", ".npz")),
}
"""{kind of file: (its option, the suffixes that the option takes)}."""


@dataclass(frozen=True)
class RunRequest:
    """A scene with its changes, the arguments of ``simulate``, the columns to keep, and files by kind. selected: whether
    ``--outputs`` names the columns. The summary then shows these columns."""

    scene: Scene
    arguments: Mapping[str, Any]
    patterns: tuple[str, ...]
    files: Mapping[str, Path]
    selected: bool = False


def names_columns(outputs: Sequence[str]) -> bool:
    """Whether patterns name columns for the summary. The pattern ``*`` selects all columns, but names no column."""
    return bool(outputs) and "*" not in outputs


def destinations(reader: ArgumentReader, **texts: str | None) -> dict[str, Path]:
    """Files to write, by kind (``FILES``). Mistakes are added to ``reader``."""
    places = {kind: reader.destination(text, FILES[kind][1], FILES[kind][0]) for kind, text in texts.items()}
    return {kind: path for kind, path in places.items() if path is not None}


def run_and_report(request: RunRequest, as_json: bool) -> int:
    """Run the scene, write its files, and print the summary. Returns the exit code."""
    result = simulated(request)
    files, late = write_files(result, request)
    shown = result.keeping(request.patterns)
    good = result.outcome.ok and not late and (shown.certainty is None or shown.certainty.met)
    code = DONE if good else FAILED
    if as_json:
        from trunnion.simulation.results.summary import document

        print_json({"exit_code": code} | document(shown) | {"files": files, "problems": [p.as_dict() for p in late]})
    else:
        from trunnion.cli.output.run_summary import print_summary

        print_summary(shown, files, late, [n for n in shown.names if n != "time"] if request.selected else None)
    return code


def simulated(request: RunRequest) -> Result:
    """Run the request with a progress bar. An animation adds the columns that it needs."""
    from trunnion.cli.output.progress_bars import ProgressBar
    from trunnion.simulation.run import run_checked

    patterns = [p for p in request.patterns if p != "time"]
    if "animation" in request.files and "*" not in patterns:
        from trunnion.plots.mechanism_pictures.instant_picture import needed

        patterns += needed(request.scene)
    with ProgressBar(request.scene.name) as bar:
        asked = dict(request.arguments)
        error = {name: asked.pop(name) for name in ("certify", "accuracy") if name in asked}
        return run_checked(request.scene, asked, patterns, bar.show_time, **error)


def write_files(result: Result, request: RunRequest) -> tuple[dict[str, str], list[Problem]]:
    """Write the files, also for a failed run. Returns (written files, problems of the other files). The table is written first.
    After Ctrl-C, the table is complete, and the other files are not written."""
    reader = ArgumentReader()
    written: dict[str, str] = {}
    try:
        if "table" in request.files:
            with held() as interrupt:
                write_kinds(result, request, ("table",), written, reader)
            if interrupt.asked:
                raise KeyboardInterrupt
        write_kinds(result, request, [k for k in request.files if k != "table"], written, reader)
    except KeyboardInterrupt:
        reader.add("files", "interrupted before all files were written", f"written: {', '.join(written.values()) or 'none'}")
    return written, reader.problems


def write_kinds(result: Result, request: RunRequest, kinds: Sequence[str], written: dict[str, str], reader: ArgumentReader) -> None:
    """Write the files of these kinds. Adds written files to ``written``, and problems to ``reader``."""
    from trunnion.simulation.results.summary import has_motion

    for kind in kinds:
        path = request.files[kind]
        if not has_motion(result) and kind != "table":
            reader.add(kind, "nothing to draw: the run did not get beyond its start", "see the outcome")
        elif kind == "linearization" and not result.outcome.ok:
            reader.add("--linearize", "the run did not reach its end, where it would be linearised", "see the outcome")
        elif reader.attempt(partial(write_file, result, request, kind, path)):
            written[kind] = str(path)


def write_file(result: Result, request: RunRequest, kind: str, path: Path) -> Path:
    """Write the file of one kind."""
    if kind == "table":
        return result.keeping(request.patterns).save(path)
    if kind == "plot":
        from trunnion.plots import figure, save_figure

        return save_figure(figure(result.keeping(request.patterns)), path)
    if kind == "linearization":
        from trunnion.analysis.mechanics.linearization import linearize

        used, patterns = result.settings, [p for p in request.patterns if p != "time"]
        return linearize(request.scene, used["until"], patterns, rtol=used["rtol"]).save(path)
    from trunnion.cli.output.progress_bars import ProgressBar
    from trunnion.plots import animate

    with ProgressBar(path.name) as bar:
        return animate(result, path, bar.show_time)
