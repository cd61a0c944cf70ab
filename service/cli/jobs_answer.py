"""``trunnion jobs answer``."""

from __future__ import annotations

from trunnion.cli.options.option_declarations import Json
from trunnion.cli.output.exit_codes import DONE, print_json
from trunnion.cli.output.text_table import print_lines
from trunnion.service.cli.job_options import ApiKey, JobId, Url
from trunnion.service.cli.job_reports import answer_lines
from trunnion.service.client.http_requests import DEFAULT_URL, Server
from trunnion.service.client.remote_jobs import Connection


def command(job: JobId, server: Url = DEFAULT_URL, key: ApiKey = "", as_json: Json = False) -> int:
    """Print the present results of a fit or a study."""
    there = Connection(Server(server, key)).job(job)
    found = there.answer
    print_json(found or {}) if as_json or (found and found["kind"] != "fit") else print_lines(answer_lines(there))
    return DONE
