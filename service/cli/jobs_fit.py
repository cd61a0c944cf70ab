"""``trunnion jobs fit``."""

from __future__ import annotations

from typing import Annotated

import typer

from trunnion.cli.options.argument_reader import ArgumentReader
from trunnion.cli.options.option_declarations import Changes, Json, Scene
from trunnion.cli.output.exit_codes import DONE, FAILED, print_json
from trunnion.cli.output.printed_output import print_lines
from trunnion.cli.requests.fit_request import Column, Compare, Data, Level, Noise, Own, Trials, VaryPrior, read_fit_request
from trunnion.service.cli.job_options import ApiKey, IdempotencyKey, Label, Tags, Url, Wait
from trunnion.service.cli.jobs import answer_lines, follow
from trunnion.service.client.http_requests import DEFAULT_URL, Server
from trunnion.service.client.remote_jobs import Connection


def command(
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
    job = Connection(Server(server, key)).fit(
        loaded, request.shared, **request.arguments(), candidates=request.candidates, trials=request.trials, budget=budget,
        label=label, tags=tag, idempotency_key=idempotency_key,
    )  # fmt: skip
    end = follow(job) if wait else job.document
    if as_json:
        print_json(end | ({"answer": job.answer} if wait else {}))
    else:
        print_lines(answer_lines(job) if wait else [job.id])
    return FAILED if wait and end["state"] != "done" else DONE
