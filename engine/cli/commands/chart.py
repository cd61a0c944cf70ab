"""``trunnion chart``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from trunnion.cli.options.argument_reader import COLUMNS_HINT, ArgumentReader, is_pattern
from trunnion.cli.options.option_declarations import Changes, Json, Scene, SettingWords, columns_option, repeatable
from trunnion.cli.output.exit_codes_and_errors import DONE
from trunnion.cli.output.printed_output import print_answer, table

if TYPE_CHECKING:
    from trunnion.analysis.work_precision.measurement_points import Measurement
    from trunnion.analysis.work_precision.request_and_results import WorkPrecision
    from trunnion.scene.data_classes.scene import Scene as SceneData

COMPARED = "Compare these columns, such as 'ball.*'."
NORM = "How errors are measured: max, or rms (better for columns that jump)."


def command(
    ctx: typer.Context,
    scene: Scene = None,
    *,
    settings: SettingWords,
    v_eps: Annotated[
        list[str], repeatable(metavar="V", help="Values of v_eps, m/s, for the laws with this number.", show_default="the scene's")
    ],
    norm: Annotated[str | None, typer.Option(metavar="N", help=NORM, show_default="max")] = None,
    repeat: Annotated[int, typer.Option(metavar="N", help="Number of times each run is repeated.")] = 7,
    samples: Annotated[int, typer.Option(metavar="N", help="Number of instants at which runs are compared.")] = 100,
    fixed: Annotated[bool, typer.Option("--fixed/--no-fixed", help="Also measure runs with fixed steps.")] = True,
    solvers: Annotated[bool, typer.Option("--solvers/--no-solvers", help="Also measure other installed programs.")] = True,
    changes: Changes,
    outputs: Annotated[list[str], columns_option(COMPARED, show_default="positions of all bodies")],
    folder: Annotated[str | None, typer.Option("-o", "--output", metavar="DIR", help="Folder for the written files.")] = None,
    as_json: Json = False,
) -> int:
    """Measure error against computing time for every method, tolerance, step and friction law."""
    from trunnion.analysis.work_precision.error_measure import NORMS

    reader = ArgumentReader()
    place = read_folder(folder, reader)
    for name, value, usual in (("--repeat", repeat, 7), ("--samples", samples, 100)):
        if value < 1:
            reader.add(name, f"{value} is too small", f"at least 1; {usual} is a good start")
    chosen = settings.values(reader)
    arguments: dict[str, Any] = {
        "methods": chosen["method"], "rtols": chosen["rtol"], "laws": chosen["law"], "until": chosen["until"],
        "v_eps": speeds(v_eps, reader), "outputs": tuple(outputs), "norm": reader.choice(norm, NORMS, "--norm") or "max",
        "samples": samples, "repeats": repeat, "fixed": fixed, "solvers": solvers,
    }  # fmt: skip
    loaded = reader.scene(scene, ctx, changes)
    reader.check_columns(loaded, outputs)
    return measure(reader.checked(loaded), arguments, place, as_json)


def measure(scene: SceneData, arguments: dict[str, Any], place: str, as_json: bool) -> int:
    """Measure errors and times, write the files to the folder ``place``, and print the results. Returns the exit code. arguments:
    fields of ``WorkPrecisionRequest``."""
    from trunnion.analysis.work_precision.benchmark_study import measure_work_precision
    from trunnion.analysis.work_precision.html_page import page_data
    from trunnion.analysis.work_precision.machine_description import pin_to_one_core
    from trunnion.analysis.work_precision.output_files import make_folder, write_work_precision
    from trunnion.analysis.work_precision.request_and_results import WorkPrecisionRequest
    from trunnion.basics.json_values import finite
    from trunnion.cli.output.progress_bars import ProgressBar

    make_folder(place)
    with pin_to_one_core(), ProgressBar(f"chart {scene.name}") as bar:
        show = (lambda _: None) if as_json else (lambda points: bar.print_line(curve_line(points)))
        study = measure_work_precision(scene, WorkPrecisionRequest(**arguments), bar.show_part, show)
    files = [str(p) for p in write_work_precision(study, place)]
    return print_answer(as_json, DONE, finite(page_data(study)) if as_json else {}, summary(study), files)


def read_folder(folder: str | None, reader: ArgumentReader) -> str:
    """The folder that ``-o`` names. Mistakes are added to ``reader``."""
    if folder is None:
        reader.add("-o", "no folder for the files is given", "for example -o charts")
    elif is_pattern(folder):
        reader.add("-o", f"{folder!r} is not the name of a folder", COLUMNS_HINT)
    return folder or ""


def speeds(texts: Sequence[str], reader: ArgumentReader) -> tuple[float, ...]:
    """The positive speeds, m/s, of an option. Mistakes are added to ``reader``."""
    values = [(text, reader.quantity(text, "m/s", "--v-eps")) for text in texts]
    for text, value in values:
        if value is not None and value <= 0:
            reader.add("--v-eps", f"{text} is not a positive speed", 'for example "1e-4 m/s"')
    return tuple(value for _, value in values if value is not None)


def curve_line(points: Sequence[Measurement]) -> str:
    """Law, method, settings, and the range of errors and times of a curve."""
    first, last, good = points[0], points[-1], [p for p in points if p.ok]
    line = f"{first.variant}: ".lstrip(": ") + f"{first.method}, {first.setting} to {last.setting}: "
    if not good:
        return line + f"failed ({first.outcome})"
    errors, times = [p.error for p in good], [1e3 * p.minimum for p in good]
    return line + f"error {max(errors):.1e} to {min(errors):.1e} in {min(times):.3g} to {max(times):.3g} ms"


def summary(study: WorkPrecision) -> list[str]:
    """References, the fastest setting at each error, other programs and failures, as lines."""
    from trunnion.analysis.work_precision.error_cost_curves import compare_with_solvers
    from trunnion.analysis.work_precision.measurement_points import pareto_front
    from trunnion.analysis.work_precision.output_files import reference_lines

    lines = [f"{study.scene.name}: {len(study.points)} settings, 0 to {study.until:g} s", *reference_lines(study)]
    best = pareto_front(p for p in study.engine_points() if p.variant == study.exact)
    rows = [(f"{p.error:.1e}", f"{1e3 * p.minimum:.3f}", f"{1e3 * p.median:.3f}", f"{p.method}, {p.setting}") for p in best]
    lines += ["", f"fastest settings at each error{f' ({study.exact})' if study.exact.law else ''}:"]
    lines += table(("error", "min ms", "median ms", "setting"), rows)
    lines += ["", *compare_with_solvers(study)] if study.solver_points() else []
    lines += [f"{name}: {text}" for name, _, text in study.solvers]
    failed = [p for p in study.points if not p.ok]
    lines += [f"{len(failed)} settings failed (crosses in the chart; listed in chart.csv)"] if failed else []
    return [*lines, *study.notes, ""]
