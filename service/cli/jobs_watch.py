"""``trunnion jobs watch``."""

from __future__ import annotations

from trunnion.cli.options.option_declarations import Json
from trunnion.cli.output.exit_codes import DONE, FAILED
from trunnion.service.cli.job_options import ApiKey, JobId, Url
from trunnion.service.cli.job_reports import follow, print_job
from trunnion.service.client.http_requests import DEFAULT_URL, Server


def command(job: JobId, server: Url = DEFAULT_URL, key: ApiKey = "", as_json: Json = False) -> int:
    """Show the progress of a job until it ends; the exit code is 1 if the job failed."""
    end = follow(Server(server, key), job)
    return print_job(end, as_json, DONE if end["state"] == "done" else FAILED)
