"""The commands ``trunnion jobs …`` that read or change one job, or list jobs. The module also prints jobs as text."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from trunnion.basics.errors import Problem, SceneError, SimulationError
from trunnion.cli.options.option_declarations import Json, repeatable
from trunnion.cli.output.exit_codes_and_errors import DONE, FAILED, error_lines, print_json
from trunnion.cli.output.printed_output import print_lines
from trunnion.service.client.http_requests import DEFAULT_URL, Server
from trunnion.service.client.remote_jobs import Job, connect

Url = Annotated[str, typer.Option("--server", metavar="URL", envvar="TRUNNION_SERVER", help="Address of the server.")]
ApiKey = Annotated[
    str,
    typer.Option(
        "--key",
        metavar="KEY",
        envvar="TRUNNION_KEY",
        help="API key. The environment variable is safer, because it is not in the list of processes.",
    ),
]
JobId = Annotated[str, typer.Argument(metavar="JOB", help="The job's id.")]
FORMATS = {".csv": "csv", ".parquet": "parquet", ".arrows": "arrow", ".json": "json"}


def show(job: JobId, server: Url = DEFAULT_URL, key: ApiKey = "", as_json: Json = False) -> int:
    """Print the state, progress, outcomes and problems of a job."""
    return print_job(connect(server, key).job(job).document, as_json, DONE)


def watch(job: JobId, server: Url = DEFAULT_URL, key: ApiKey = "", as_json: Json = False) -> int:
    """Show the progress of a job until the job ends. The exit code is 1 if the job failed."""
    end = follow(connect(server, key).job(job))
    return print_job(end, as_json, DONE if end["state"] == "done" else FAILED)


def list_(
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


def results(
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


def answer(job: JobId, server: Url = DEFAULT_URL, key: ApiKey = "", as_json: Json = False) -> int:
    """Print the present results of a fit or a study."""
    there = connect(server, key).job(job)
    found = there.answer
    print_json(found or {}) if as_json or (found and found["kind"] != "fit") else print_lines(answer_lines(there))
    return DONE


def cancel(job: JobId, server: Url = DEFAULT_URL, key: ApiKey = "", as_json: Json = False) -> int:
    """Cancel a job. The server keeps the computed rows."""
    found = Server(server, key).request("DELETE", f"/v1/jobs/{job}").json()
    print_json(found) if as_json else print(job_line(found))
    return DONE


def rerun(
    job: JobId,
    *,
    outcome: Annotated[list[str], repeatable(metavar="NAME", help="Only cases with this outcome.")],
    method: Annotated[str, typer.Option(metavar="M", help="Another integration method.")] = "",
    cpu_limit: Annotated[str, typer.Option(metavar="S", help="Another limit of processor time for each case, s.")] = "",
    server: Url = DEFAULT_URL,
    key: ApiKey = "",
) -> int:
    """Run the failed cases of a job again, as a new job. Print the id of the new job."""
    body = given(method=method, cpu_limit=cpu_limit, outcomes=outcome)
    print(Server(server, key).request("POST", f"/v1/jobs/{job}/rerun", json=body).json()["id"])
    return DONE


def delete(job: JobId, server: Url = DEFAULT_URL, key: ApiKey = "") -> int:
    """Delete a job that has ended, with all its results."""
    Server(server, key).request("DELETE", f"/v1/jobs/{job}", params={"purge": "true"})
    print(f"deleted {job}")
    return DONE


def follow(job: Job) -> dict[str, Any]:
    """Wait for the end of a job, and return its document. A terminal shows a progress bar. SimulationError after Ctrl-C."""
    try:
        return job.wait(progress=True).document
    except KeyboardInterrupt:
        raise SimulationError(f"stopped watching; the job continues: trunnion jobs watch {job.id}, or cancel {job.id}") from None


def job_line(job: dict[str, Any]) -> str:
    """One line about a job: id, state, progress, scene, outcomes, label."""
    outcomes = ", ".join(f"{n} {name}" for name, n in job["outcomes"].items())
    line = f"{job['id']}  {job['state']:<10} {job['done']}/{job['cases']}  {job['scene']}"
    return line + (f"  ({outcomes})" if outcomes else "") + (f"  {job['label']}" if job["label"] else "")


def print_job(job: dict[str, Any], as_json: bool, code: int) -> int:
    """Print a job and return the exit code ``code``. In text output, the problems go to standard error."""
    if as_json:
        print_json(job)
        return code
    print(job_line(job))
    if job["state"] == "running" and job["eta_seconds"] is not None:
        print(f"about {job['eta_seconds']:.0f} s to go")
    error_lines(str(Problem(**p)) for p in job["problems"])
    return code


def answer_lines(job: Job) -> list[str]:
    """The lines that ``trunnion fit`` would print for the result of a job with a fit."""
    from trunnion.analysis.fits.fits_from_plain_data import read_comparison, read_fit, read_ranking
    from trunnion.cli.output.fit_report import lines, proposal_lines

    found = job.answer
    if found is None or found["fit"] is None:
        return [found["why"] if found and found["why"] else f"no answer yet: the job is {job.refresh().document['stage']}"]
    fit = read_fit(found["fit"])
    evidence = read_comparison(found["compared"]) if found["compared"] else None
    return [*lines(job.document["scene"], fit, evidence), *proposal_lines(read_ranking(found["experiments"]), fit)]


def given(**values: Any) -> dict[str, Any]:
    """The values that are neither empty nor None."""
    return {name: value for name, value in values.items() if value}
