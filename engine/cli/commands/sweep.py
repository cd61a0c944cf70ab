"""``trunnion sweep``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

import typer

from trunnion.basics.interrupts import held
from trunnion.cli.options.argument_reader import ArgumentReader
from trunnion.cli.options.option_declarations import Changes, Json, Reduce, Scene, SettingWords, Table, Workers, repeatable
from trunnion.cli.output.exit_codes_and_errors import DONE, FAILED
from trunnion.cli.output.printed_output import number, outcome_counts, print_answer, table
from trunnion.cli.requests.run_request import destinations
from trunnion.cli.requests.trajectory_request import Certify, Spacing, Trajectories, rows_destination, trajectory_arguments
from trunnion.cli.requests.varied_numbers import MU, Sample, Sampling, Seed, Vary, spreads_by_path, values_by_path

if TYPE_CHECKING:
    from pathlib import Path

    from trunnion.batch.plan_and_runner import Plan
    from trunnion.batch.sweep import Sweep
    from trunnion.cli.output.sample_report import SampleQueries
    from trunnion.scene.data_classes.scene import Scene as SceneData

SHOWN = 12
ROWS = "File for the stored rows (.csv or .parquet), or a folder for one Parquet file for each case."


def command(
    ctx: typer.Context,
    scene: Scene = None,
    *,
    settings: SettingWords,
    vary: Vary,
    sample: Sample,
    count: Annotated[int, typer.Option(metavar="N", help="Number of sampled cases; for saltelli, number of points.")] = 0,
    seed: Seed = 0,
    sampling: Sampling = "latin",
    quantiles: Annotated[list[str], repeatable(metavar="P,…", help="Compute the quantiles of each result at these probabilities.")],
    above: Annotated[
        list[str], repeatable(metavar="KIND:WHAT=BOUND", help="Compute the probability that a result exceeds a bound.")
    ],
    reduce: Reduce,
    trajectories: Trajectories,
    spacing: Spacing = None,
    rows: Annotated[str | None, typer.Option(metavar="FILE", help=ROWS)] = None,
    certify: Certify = False,
    changes: Changes,
    save: Table = None,
    plot: Annotated[
        str | None, typer.Option(metavar="FILE", help="Draw Sobol indices or, without indices, histograms: .png, .svg or .pdf.")
    ] = None,
    workers: Workers = None,
    as_json: Json = False,
) -> int:
    """Run a scene for many values of its numbers; each run is a case, with one row in the table of results."""
    from trunnion.cli.output.sample_report import read_queries

    reader = ArgumentReader()
    files = destinations(reader, table=save, plot=plot)
    row_file = rows_destination(rows, trajectories, reader)
    queries = read_queries(quantiles, above, files.get("plot"), reader)
    chosen = settings.values(reader)
    loaded = reader.scene(scene, ctx, changes, chosen.pop("law"))
    extra = {"count": count, "seed": seed, "sampling": sampling, "keep": tuple(reduce)}
    extra |= trajectory_arguments(trajectories, spacing, certify, reader)
    cases = reader.checked(planned(loaded, vary, sample, chosen, extra, queries, reader))
    return run_and_report(cases, workers, queries, files.get("table"), row_file, as_json)


def planned(
    scene: SceneData | None,
    vary: Sequence[str],
    sample: Sequence[str],
    settings: dict[str, Any],
    extra: dict[str, Any],
    queries: SampleQueries,
    reader: ArgumentReader,
) -> Plan | None:
    """The plan of the cases; None after mistakes. extra: further arguments of ``plan``. queries: requested statistics of the
    sample."""
    from trunnion.batch.plan_and_runner import Run, plan
    from trunnion.batch.sample_statistics.result_queries import refused

    axes, samples = values_by_path(vary, "--vary", reader), spreads_by_path(sample, reader)
    if not vary and not sample:
        reader.add("--vary", "no number varies", f"for example --vary {MU}=0.1:0.6:26")
    if scene is None or not (axes or samples):
        return None
    cases = reader.attempt(partial(plan, scene, axes or None, None, samples or None, run=Run(**settings), **extra))
    if cases is not None and queries:
        reader.problems += refused(cases.cases, cases.reductions, (), queries.at, queries.above)
    return cases


def run_and_report(
    cases: Plan, workers: int | None, queries: SampleQueries, table_file: Path | None, row_file: Path | None, as_json: bool
) -> int:
    """Run the cases, write the files, and print the summary. Returns the exit code."""
    from trunnion.batch.sweep import run_plan
    from trunnion.cli.output.progress_bars import ProgressBar
    from trunnion.cli.output.sample_report import sample_statistics

    with ProgressBar(f"{cases.cases.count} cases") as bar:
        result = run_plan(cases, workers, bar.show_count)
    with held():
        if table_file is not None:
            result.save(table_file)
        if row_file is not None:
            result.save_trajectories(row_file)
    statistics, statistics_lines = sample_statistics(result, queries)
    code = DONE if result.counts.get("done") and not result.cancelled else FAILED
    return print_answer(
        as_json, code, {"problems": []} | document(result) | statistics, [*summary(result), *statistics_lines],
        {"table": table_file, "rows": row_file, "picture": queries.picture},
    )  # fmt: skip


def document(result: Sweep) -> dict[str, Any]:
    """The sweep without its rows, as plain data."""
    from trunnion.batch.tables.case_table import WHY

    times = {"wall": result.wall_time, "stepping": result.stepping_time, "build": result.build_time}
    kept = [{"name": r.name, "unit": r.unit, "description": r.description} for r in result.plan.reductions]
    cases = {"cases": len(result), "of": result.plan.cases.count, "cancelled": result.cancelled}
    errors = {"errors_unstated": result.missing_error_reasons} if WHY in result.table.column_names else {}
    return {"scene": result.plan.scene.name, **cases, "outcomes": result.counts, **errors, "seconds": times, "reductions": kept}


def summary(result: Sweep) -> list[str]:
    """Outcomes, cost and ranges of the reductions, as lines."""
    import pyarrow.compute as pc

    rows = []
    for r in result.plan.reductions[:SHOWN]:
        values = result.table[r.name]
        ends = pc.min_max(values).as_py()
        low, high = ("–" if ends[end] is None else number(ends[end]) for end in ("min", "max"))
        rows.append((r.name, low, high, str(len(values) - values.null_count), r.unit))
    more = len(result.plan.reductions) - len(rows)
    return [
        f"{result.plan.scene.name}: {len(result)} cases over {', '.join(result.plan.cases.paths)}",
        *([f"cancelled: {len(result)} of {result.plan.cases.count} cases finished and are kept"] if result.cancelled else []),
        outcome_counts(result.counts),
        *missing_errors(result.missing_error_reasons),
        f"{result.wall_time:.3g} s, stepping {result.stepping_time:.3g} s (sum of all cores)"
        + (f", built in {result.build_time:.3g} s" if result.build_time else ""),
        "",
        *table(("reduction", "least", "largest", "cases", "unit"), rows),
        *([f"… and {more} more"] if more > 0 else []),
    ]


def missing_errors(counts: Mapping[str, int]) -> list[str]:
    """A line with the number of cases for which no errors are stated, and the reasons."""
    from trunnion.simulation.results.error_statement import REASONS

    return [f"no error estimates for {n} case{'s' if n > 1 else ''} ({why}): {REASONS[why]}" for why, n in sorted(counts.items())]
