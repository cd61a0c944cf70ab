"""``trunnion jobs delete``."""

from __future__ import annotations

from trunnion.cli.output.exit_codes import DONE
from trunnion.service.cli.job_options import ApiKey, JobId, Url
from trunnion.service.client.http_requests import DEFAULT_URL, Server


def command(job: JobId, server: Url = DEFAULT_URL, key: ApiKey = "") -> int:
    """Delete a job that has ended, with all its results."""
    Server(server, key).request("DELETE", f"/v1/jobs/{job}", params={"purge": "true"})
    print(f"deleted {job}")
    return DONE
