"""Text output of jobs: summary line, progress, result of a fit."""

from __future__ import annotations

import time
from typing import Any

from trunnion.basics.problems import Problem, SimulationError
from trunnion.cli.output.exit_codes import error_lines, print_json
from trunnion.service.client.http_requests import ENDED, Server
from trunnion.service.client.remote_jobs import Job

POLL_SECONDS = 0.5


def follow(server: Server, job: str) -> dict[str, Any]:
    """Poll a job until it ends, and return its document. A terminal shows a progress bar. SimulationError after Ctrl-C."""
    from trunnion.cli.output.progress_bars import ProgressBar

    try:
        with ProgressBar(f"job {job[:8]}") as bar:
            while True:
                now: dict[str, Any] = server.request("GET", f"/v1/jobs/{job}").json()
                bar.show_count(now["done"] + now["lost"], now["cases"])
                if now["state"] in ENDED:
                    return now
                time.sleep(POLL_SECONDS)
    except KeyboardInterrupt:
        raise SimulationError(f"stopped watching; the job continues: trunnion jobs watch {job}, or cancel {job}") from None


def job_line(job: dict[str, Any]) -> str:
    """One line about a job: id, state, progress, scene, outcomes, label."""
    outcomes = ", ".join(f"{n} {name}" for name, n in job["outcomes"].items())
    line = f"{job['id']}  {job['state']:<10} {job['done']}/{job['cases']}  {job['scene']}"
    return line + (f"  ({outcomes})" if outcomes else "") + (f"  {job['label']}" if job["label"] else "")


def print_job(job: dict[str, Any], as_json: bool, code: int) -> int:
    """Print a job and return the exit code ``code``. Text output has the problems on standard error."""
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
    from trunnion.analysis.fits.result_reader import read_comparison, read_fit, read_ranking
    from trunnion.cli.output.fit_report import lines, proposal_lines

    found = job.answer
    if found is None or found["fit"] is None:
        return [found["why"] if found and found["why"] else f"no answer yet: the job is {job.refresh().document['stage']}"]
    fit = read_fit(found["fit"])
    evidence = read_comparison(found["compared"]) if found["compared"] else None
    return [*lines(job.document["scene"], fit, evidence), *proposal_lines(read_ranking(found["experiments"]), fit)]
