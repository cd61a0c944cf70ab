"""``trunnion jobs rerun``."""

from __future__ import annotations

from typing import Annotated

import typer

from trunnion.cli.options.option_declarations import repeatable
from trunnion.cli.output.exit_codes import DONE
from trunnion.service.cli.job_options import ApiKey, JobId, Url, given
from trunnion.service.client.http_requests import DEFAULT_URL, Server


def command(
    job: JobId,
    *,
    outcome: Annotated[list[str], repeatable(metavar="NAME", help="Only cases with this outcome.")],
    method: Annotated[str, typer.Option(metavar="M", help="Another integration method.")] = "",
    cpu_limit: Annotated[str, typer.Option(metavar="S", help="Another limit of processor time for each case, s.")] = "",
    server: Url = DEFAULT_URL,
    key: ApiKey = "",
) -> int:
    """Run the failed cases of a job again, as a new job; print its id."""
    body = given(method=method, cpu_limit=cpu_limit, outcomes=outcome)
    print(Server(server, key).request("POST", f"/v1/jobs/{job}/rerun", json=body).json()["id"])
    return DONE
