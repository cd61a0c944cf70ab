"""``trunnion jobs show``."""

from __future__ import annotations

from trunnion.cli.options.option_declarations import Json
from trunnion.cli.output.exit_codes import DONE
from trunnion.service.cli.job_options import ApiKey, JobId, Url
from trunnion.service.cli.job_reports import print_job
from trunnion.service.client.http_requests import DEFAULT_URL, Server


def command(job: JobId, server: Url = DEFAULT_URL, key: ApiKey = "", as_json: Json = False) -> int:
    """Print the state, progress, outcomes and problems of a job."""
    return print_job(Server(server, key).request("GET", f"/v1/jobs/{job}").json(), as_json, DONE)
