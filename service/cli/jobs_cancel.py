"""``trunnion jobs cancel``."""

from __future__ import annotations

from trunnion.cli.options.option_declarations import Json
from trunnion.cli.output.exit_codes import DONE, print_json
from trunnion.service.cli.job_options import ApiKey, JobId, Url
from trunnion.service.cli.job_reports import job_line
from trunnion.service.client.http_requests import DEFAULT_URL, Server


def command(job: JobId, server: Url = DEFAULT_URL, key: ApiKey = "", as_json: Json = False) -> int:
    """Cancel a job; the computed rows are kept."""
    found = Server(server, key).request("DELETE", f"/v1/jobs/{job}").json()
    print_json(found) if as_json else print(job_line(found))
    return DONE
