"""``trunnion jobs list``."""

from __future__ import annotations

from typing import Annotated

import typer

from trunnion.cli.options.option_declarations import Json
from trunnion.cli.output.exit_codes import DONE, print_json
from trunnion.service.cli.job_options import ApiKey, Url, given
from trunnion.service.cli.job_reports import job_line
from trunnion.service.client.http_requests import DEFAULT_URL, Server


def command(
    state: Annotated[str | None, typer.Option(metavar="STATE", help="Only jobs in this state.")] = None,
    tag: Annotated[str | None, typer.Option("--tag", metavar="TAG", help="Only jobs with this tag.")] = None,
    search: Annotated[str | None, typer.Option(metavar="TEXT", help="Only jobs with this text in label, tag, scene or id.")] = None,
    limit: Annotated[int, typer.Option(metavar="N", min=1, max=500, help="Largest number of jobs.")] = 20,
    server: Url = DEFAULT_URL,
    key: ApiKey = "",
    as_json: Json = False,
) -> int:
    """List the newest jobs."""
    found = Server(server, key).request("GET", "/v1/jobs", params=given(limit=limit, state=state, tag=tag, search=search)).json()
    print_json(found) if as_json else print("\n".join(map(job_line, found["jobs"])) or "no jobs")
    return DONE
