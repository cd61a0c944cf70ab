"""``trunnion jobs submit``."""

from __future__ import annotations

from typing import Annotated

import typer

from trunnion.cli.options.argument_reader import ArgumentReader
from trunnion.cli.options.option_declarations import Changes, Json, Reduce, Scene, SettingWords
from trunnion.cli.output.exit_codes import DONE, FAILED, print_json
from trunnion.cli.requests.trajectory_request import Certify, Spacing, Trajectories, trajectory_arguments
from trunnion.cli.requests.varied_numbers import Sample, Sampling, Seed, Vary, spreads_by_path, values_by_path
from trunnion.service.cli.job_options import ApiKey, IdempotencyKey, Label, Tags, Url, Wait, given
from trunnion.service.cli.jobs import follow, job_line
from trunnion.service.client.http_requests import DEFAULT_URL, Server
from trunnion.service.client.remote_jobs import Connection


def command(
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
    job = Connection(Server(server, key)).submit(
        loaded, reductions=reduce, label=label, tags=tag, idempotency_key=idempotency_key, **body
    )
    end = follow(job) if wait else job.document
    print_json(end) if as_json else print(job_line(end) if wait else job.id)
    return FAILED if wait and end["state"] != "done" else DONE
