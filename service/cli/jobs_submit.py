"""``trunnion jobs submit`` and ``trunnion jobs fit``."""

from __future__ import annotations

from typing import Annotated

import typer

from trunnion.cli.options.argument_reader import ArgumentReader
from trunnion.cli.options.option_declarations import Changes, Json, Reduce, Scene, SettingWords, repeatable
from trunnion.cli.output.exit_codes_and_errors import DONE, FAILED, print_json
from trunnion.cli.output.printed_output import print_lines
from trunnion.cli.requests.fit_request import Column, Compare, Data, Level, Noise, Own, Trials, VaryPrior, read_fit_request
from trunnion.cli.requests.trajectory_request import Certify, Spacing, Trajectories, trajectory_arguments
from trunnion.cli.requests.varied_numbers import Sample, Sampling, Seed, Vary, spreads_by_path, values_by_path
from trunnion.service.cli.jobs import ApiKey, Url, answer_lines, follow, given, job_line
from trunnion.service.client.http_requests import DEFAULT_URL
from trunnion.service.client.remote_jobs import connect

Label = Annotated[str, typer.Option("--label", metavar="TEXT", help="Text that describes the job.")]
Tags = Annotated[list[str], repeatable("--tag", metavar="TAG", help="Word by which the list of jobs can be searched.")]
IdempotencyKey = Annotated[
    str,
    typer.Option(
        "--idempotency-key",
        metavar="KEY",
        help="Name of this submission. A repeated submission with the same name creates no second job.",
    ),
]
Wait = Annotated[bool, typer.Option("--wait", help="Wait for the end of the job and print its results.")]


def submit(
    ctx: typer.Context,
    scene: Scene = None,
    *,
    settings: SettingWords,
    vary: Vary,
    sample: Sample,
    count: Annotated[int, typer.Option(metavar="N", help="Number of sampled cases; with saltelli, number of points.")] = 100,
    seed: Seed = 0,
    sampling: Sampling = "latin",
    reduce: Reduce,
    trajectories: Trajectories,
    spacing: Spacing = None,
    certify: Certify = False,
    changes: Changes,
    label: Label = "",
    tag: Tags,
    idempotency_key: IdempotencyKey = "",
    wait: Wait = False,
    server: Url = DEFAULT_URL,
    key: ApiKey = "",
    as_json: Json = False,
) -> int:
    """Submit a sweep to a server and print the job's id."""
    reader = ArgumentReader()
    axes, samples = values_by_path(vary, "--vary", reader), spreads_by_path(sample, reader)
    body = settings.values(reader) | given(**trajectory_arguments(trajectories, spacing, certify, reader))
    loaded = reader.checked(reader.scene(scene, ctx, changes))
    body |= given(vary={p: v if ":" in v else v.split(",") for p, v in axes.items()})
    body |= {"sample": {"ranges": samples, "count": count, "seed": seed, "method": sampling}} if samples else {}
    job = connect(server, key).submit(
        loaded, reductions=reduce, label=label, tags=tag, idempotency_key=idempotency_key, **body
    )
    end = follow(job) if wait else job.document
    print_json(end) if as_json else print(job_line(end) if wait else job.id)
    return FAILED if wait and end["state"] != "done" else DONE


def fit(
    ctx: typer.Context,
    scene: Scene = None,
    *,
    data: Data,
    vary: VaryPrior,
    own: Own,
    column: Column,
    noise: Noise,
    level: Level = "0.95",
    compare: Compare,
    trials: Trials,
    changes: Changes,
    budget: Annotated[
        float | None, typer.Option(metavar="S", help="Limit of the computing time, s.", show_default="what the server allows")
    ] = None,
    label: Label = "",
    tag: Tags,
    idempotency_key: IdempotencyKey = "",
    wait: Wait = False,
    server: Url = DEFAULT_URL,
    key: ApiKey = "",
    as_json: Json = False,
) -> int:
    """Submit a fit to measured curves to a server and print the job's id."""
    reader = ArgumentReader()
    loaded = reader.scene(scene, ctx, changes)
    request = read_fit_request(
        loaded, reader, data=data, vary=vary, own=own, column=column, noise=noise, level=level, compare=compare, trials=trials
    )
    loaded = reader.checked(loaded)
    job = connect(server, key).fit(
        loaded, request.shared, **request.arguments(), candidates=request.candidates, trials=request.trials, budget=budget,
        label=label, tags=tag, idempotency_key=idempotency_key,
    )  # fmt: skip
    end = follow(job) if wait else job.document
    if as_json:
        print_json(end | ({"answer": job.answer} if wait else {}))
    else:
        print_lines(answer_lines(job) if wait else [job.id])
    return FAILED if wait and end["state"] != "done" else DONE
