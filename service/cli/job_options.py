"""Arguments and options that the commands ``jobs …`` share."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from trunnion.cli.options.option_declarations import repeatable

Url = Annotated[str, typer.Option("--server", metavar="URL", envvar="TRUNNION_SERVER", help="Address of the server.")]
ApiKey = Annotated[
    str,
    typer.Option("--key", metavar="KEY", envvar="TRUNNION_KEY", help="API key; the environment variable is safer than the option."),
]
JobId = Annotated[str, typer.Argument(metavar="JOB", help="The job's id.")]
Label = Annotated[str, typer.Option("--label", metavar="TEXT", help="Text that describes the job.")]
Tags = Annotated[list[str], repeatable("--tag", metavar="TAG", help="Word by which the list of jobs can be searched.")]
IdempotencyKey = Annotated[
    str,
    typer.Option(
        "--idempotency-key",
        metavar="KEY",
        help="Name of this submission; if it is repeated with the same name, the server creates no second job.",
    ),
]
Wait = Annotated[bool, typer.Option("--wait", help="Wait for the end of the job and print its results.")]


def given(**values: Any) -> dict[str, Any]:
    """The values that are neither empty nor None."""
    return {name: value for name, value in values.items() if value}
