"""A study that ``optimise`` or ``refine`` requests. The cases of a study run in rounds. The command prints and draws the answer,
and writes it as a table.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

import typer

from trunnion.basics.interrupts import held
from trunnion.cli.options import completion
from trunnion.cli.options.argument_reader import ArgumentReader
from trunnion.cli.options.option_declarations import SettingWords, repeatable
from trunnion.cli.output.exit_codes_and_errors import DONE, FAILED
from trunnion.cli.output.printed_output import outcome_counts, print_answer, table
from trunnion.cli.requests.run_request import destinations
from trunnion.cli.requests.varied_numbers import MU, bounds_by_path

if TYPE_CHECKING:
    from pathlib import Path

    from trunnion.analysis.studies.optimise_and_refine import StudyResult
    from trunnion.batch.sweep import Sweep

SHOWN = 20
VaryWithin = Annotated[
    list[str],
    repeatable(
        "--vary", metavar="PATH=LOW:HIGH", help="A number that varies, with its bounds.", autocompletion=completion.assignments
    ),
]
MostCases = Annotated[int, typer.Option("--cases", metavar="N", help="Largest number of cases.")]


def run_and_report_study(
    kind: str,
    ctx: typer.Context,
    scene: str | None,
    settings: SettingWords,
    vary: Sequence[str],
    reduce: Sequence[str],
    changes: Sequence[str],
    files: Mapping[str, str | None],
    workers: int | None,
    as_json: bool,
    reader: ArgumentReader,
    **fields: Any,
) -> int:
    """Run a study and report its answer. Returns the exit code, which is 1 if no case satisfies the request, or after Ctrl-C. kind:
    "optimise" or "refine". reader: collects the mistakes. fields: fields of ``StudyRequest``."""
    from trunnion.analysis.studies.optimise_and_refine import run_study
    from trunnion.analysis.studies.request import StudyRequest, make_study
    from trunnion.batch.plan_and_runner import Run
    from trunnion.cli.output.progress_bars import ProgressBar

    places = destinations(reader, **files)
    chosen = settings.values(reader)
    bounds = bounds_by_path(vary, reader)
    if not vary:
        reader.add("--vary", "no number varies", f"for example --vary {MU}=0.1:0.6")
    loaded = reader.scene(scene, ctx, changes, chosen.pop("law"))
    study = None
    if loaded is not None and bounds:
        study = reader.attempt(partial(make_study, loaded, StudyRequest(kind, bounds, **fields), list(reduce), Run(**chosen)))
    study = reader.checked(study)
    with ProgressBar(f"{kind}, at most {fields['cases']} cases") as bar:
        result = run_study(*study, workers, bar.show_count)
    with held():
        if "table" in places:
            result.save(places["table"])
        if "plot" in places:
            draw(result, places["plot"])
    code = DONE if result.answer.get("feasible", True) and not result.sweep.cancelled else FAILED
    document = {"problems": [], **result.answer, "outcomes": result.sweep.counts}
    written = {"table": places.get("table"), "picture": places.get("plot")}
    return print_answer(as_json, code, document, lines(result), written)


def lines(result: StudyResult) -> list[str]:
    """The answer as text."""
    a, sweep = result.answer, result.sweep
    counts = outcome_counts(sweep.counts)
    head = [f"{sweep.plan.scene.name}: {a['cases']} cases ({counts}), {sweep.wall_time:.3g} s", str(a["why"]), ""]
    if a["kind"] == "refine":
        return head + boundary_lines(a)
    goal = f"{a['goal']} {a['of']}" + (f" = {a['target']:g}" if a["target"] is not None else "")
    if not a["feasible"]:
        missed = a["constraints_missed"]
        nearest = f"no case satisfies all constraints; the nearest case misses them by {missed or 0.0:.3g} of their scales:"
        head.append("no case has a value" if missed is None else nearest)
    elif a["off_target"]:
        head.append(f"off target by {a['off_target']:.3g} {unit_of(sweep, a['of'])}".rstrip())
    numbers = [(n["path"], f"{n['value']:.9g}", n["unit"]) for n in a["numbers"]]
    results = [(n, "–" if v is None else f"{v:.9g}", unit_of(sweep, n)) for n, v in a["results"].items()]
    return [*head, *table((goal, f"case {a['case']}", "unit"), numbers + results)]


def unit_of(sweep: Sweep, name: str) -> str:
    """The unit of a reduction."""
    return next((r.unit for r in sweep.plan.reductions if r.name == name), "")


def boundary_lines(a: Mapping[str, Any]) -> list[str]:
    """The values at which outcomes change or the result jumps, as lines."""
    rows = []
    for b in a["boundaries"][:SHOWN]:
        places = (f"{low:.7g} … {high:.7g}" for low, high in zip(b["low"], b["high"], strict=True))
        what = " | ".join(o.replace("_", " ") for o in b["outcomes"]) if b["change"] is None else f"jumps by {b['change']:.4g}"
        rows.append((*places, what))
    more = len(a["boundaries"]) - len(rows) + a["more"]
    if not rows:
        return [f"{a['of']}: neither jumps nor changes of outcome"]
    return [*table((*a["paths"], "between them"), rows), *([f"… and {more} more (--json lists all)"] if more > 0 else [])]


def draw(result: StudyResult, path: Path) -> None:
    """Draw the convergence of an optimisation, or the map of a refinement."""
    from trunnion.plots.analysis.optimisation_and_outcome_boundaries import draw_convergence, draw_refinement
    from trunnion.plots.style.figure_files import save_figure

    picture = draw_refinement if result.answer["kind"] == "refine" else draw_convergence
    save_figure(picture(result.answer, result.sweep), path)
