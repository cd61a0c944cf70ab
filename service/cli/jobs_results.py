"""``trunnion jobs results``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from trunnion.basics.problems import Problem, SceneError
from trunnion.cli.output.exit_codes import DONE
from trunnion.service.cli.job_options import ApiKey, JobId, Url
from trunnion.service.client.http_requests import DEFAULT_URL, Server

FORMATS = {".csv": "csv", ".parquet": "parquet", ".arrows": "arrow", ".json": "json"}


def command(
    job: JobId,
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE", help="Write a table: .csv, .parquet, .arrows or .json.")
    ],
    case: Annotated[int | None, typer.Option(metavar="N", help="Fetch all rows of this case instead of the results.")] = None,
    rows: Annotated[
        bool, typer.Option("--rows", help="Fetch the stored rows of all cases instead (see jobs submit --trajectories).")
    ] = False,
    certify: Annotated[bool, typer.Option("--certify", help="With --case: add the global error of each column.")] = False,
    server: Url = DEFAULT_URL,
    key: ApiKey = "",
) -> int:
    """Fetch the table of a job, all rows of one case, or the stored rows of all cases."""
    kind = FORMATS.get(output.suffix.lower())
    if kind is None:
        raise SceneError([Problem("-o", f"{str(output)!r} has an unknown format", f"end it in {', '.join(FORMATS)}")])
    if rows and case is not None:
        raise SceneError([Problem("--rows", "excludes --case", "keep one of them")])
    what = "trajectories" if rows else "results" if case is None else f"cases/{case}/trajectory"
    params = {"format": kind} | ({"certify": "true"} if certify and case is not None else {})
    Server(server, key).save(f"/v1/jobs/{job}/{what}", output, params=params)
    print(f"wrote {output}")
    return DONE
