"""``trunnion jobs …``: a server's jobs from the command line."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Annotated, Any

import typer

from engine.basics.problems import Problem, SceneError, SimulationError
from engine.cli import finding
from engine.cli.running import DONE, FAILED, print_json
from engine.cli.settings import Words, with_settings
from service.answer_told import answer_lines
from service.asking import ENDED, HERE, Server, checked, problems_of
from service.remote import Connection, Job, connect

app = typer.Typer(add_completion=False, no_args_is_help=True, help="Submit, follow and fetch jobs of a server (trunnion serve).")
URL = typer.Option("--server", metavar="URL", envvar="TRUNNION_SERVER", help="The server.")
KEY = typer.Option("--key", metavar="KEY", envvar="TRUNNION_KEY", help="API key; better in the environment than here.")
JSON = typer.Option("--json", help="Print one JSON document instead of text.")
JOB = typer.Argument(metavar="JOB", help="The job's id.")
Url = Annotated[str, URL]
Secret = Annotated[str, KEY]
AsJson = Annotated[bool, JSON]
Id = Annotated[str, JOB]


@app.command()
@with_settings("trunnion jobs submit")
def submit(
    settings: Words,
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="A scene file, a folder with a scene.yaml, or a bundled model.")],
    over: Annotated[list[str] | None, typer.Option(metavar="PATH=VALUES", help="first:last:count, or a,b,c (repeatable).")] = None,
    sample: Annotated[list[str] | None, typer.Option(metavar="PATH=SPREAD", help="low:high, or 'normal(…)', …")] = None,
    count: Annotated[int, typer.Option(metavar="N", help="How many cases to sample.")] = 100,
    seed: Annotated[int, typer.Option(metavar="S", help="Seed of the sample.")] = 0,
    sampling: Annotated[str, typer.Option(metavar="HOW", help="latin, random, sobol or saltelli.")] = "latin",
    reduce: Annotated[list[str] | None, typer.Option(metavar="KIND:WHAT", help="What to keep of each case (repeatable).")] = None,
    trajectories: Annotated[list[str] | None, typer.Option(metavar="PATTERN", help="Columns whose rows are kept.")] = None,
    spacing: Annotated[str | None, typer.Option(metavar="S", help="How far apart the rows kept are (default: all).")] = None,
    certify: Annotated[bool, typer.Option("--certify", help="Keep the error of each result too.")] = False,
    changes: Annotated[list[str] | None, typer.Option("--set", metavar="PATH=VALUE", help="Change a number (repeatable).")] = None,
    label: Annotated[str, typer.Option(metavar="TEXT", help="Words of your own.")] = "",
    tag: Annotated[list[str] | None, typer.Option(metavar="TAG", help="A word to find it by (repeatable).")] = None,
    idempotency_key: Annotated[str, typer.Option(metavar="KEY", help="Sent again, makes no second job.")] = "",
    wait: Annotated[bool, typer.Option("--wait", help="Wait until it has ended.")] = False,
    server: Url = HERE,
    key: Secret = "",
    as_json: AsJson = False,
) -> None:
    """Submit a batch; print the job's id."""
    from engine.cli import options
    from engine.cli.keeping import Kept
    from engine.cli.options import Findings
    from engine.cli.simulating import loaded
    from engine.cli.sweeping import ranges, spans
    from engine.scene.dump import scene_to_dict

    found, kept = Findings(), Kept(trajectories or (), spacing, certify=certify)
    axes, sampled = spans(over or (), "--over", found), ranges(sample or (), found)
    body = options.settings("trunnion jobs submit", settings, found)
    body |= {n: v for n, v in kept.planned(found).items() if v}
    read = loaded(scene, options.assignments(changes or (), found), None, found)
    found.end()
    assert read is not None
    body |= {"scene": scene_to_dict(read), "reductions": reduce or [], "label": label, "tags": tag or []}
    body |= {"over": {p: v if ":" in v else v.split(",") for p, v in axes.items()}} if axes else {}
    body |= {"sample": {"ranges": sampled, "count": count, "seed": seed, "method": sampling}} if sampled else {}
    s = Server(server, key)
    job = s.ask("POST", "/v1/jobs", json=body, headers={"Idempotency-Key": idempotency_key} if idempotency_key else {}).json()
    if wait:
        job = _followed(s, job["id"])
    print_json(job) if as_json else print(_line(job) if wait else job["id"])
    raise typer.Exit(FAILED if wait and job["state"] != "done" else DONE)


@app.command("fit")
def submit_fit(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="Bundled model or scene file.")],
    data: Annotated[list[str] | None, finding.DATA] = None,
    to: Annotated[list[str] | None, finding.TO] = None,
    own: Annotated[list[str] | None, finding.OWN] = None,
    column: Annotated[list[str] | None, finding.COLUMN] = None,
    noise: Annotated[list[str] | None, finding.NOISE] = None,
    level: Annotated[str, typer.Option(metavar="P", help="Level of the intervals.")] = "0.95",
    compare: Annotated[list[str] | None, finding.COMPARE] = None,
    trials: Annotated[list[str] | None, finding.TRY] = None,
    changes: Annotated[list[str] | None, typer.Option("--set", metavar="PATH=VALUE", help="Change a number (repeatable).")] = None,
    budget: Annotated[float | None, typer.Option(metavar="S", help="Seconds of work after which it is given up.")] = None,
    label: Annotated[str, typer.Option(metavar="TEXT", help="Words of your own.")] = "",
    tag: Annotated[list[str] | None, typer.Option(metavar="TAG", help="A word to find it by (repeatable).")] = None,
    idempotency_key: Annotated[str, typer.Option(metavar="KEY", help="Sent again, makes no second job.")] = "",
    wait: Annotated[bool, typer.Option("--wait", help="Wait until it has ended, and tell what was found.")] = False,
    server: Url = HERE,
    key: Secret = "",
    as_json: AsJson = False,
) -> None:
    """Submit a fit to measured curves, asked for as `trunnion fit`; print the job's id."""
    from engine.cli.charting import print_lines
    from engine.cli.fitting import FitWish, wished
    from engine.cli.options import Findings

    words = (data or (), to or (), own or (), column or (), noise or (), level, compare or (), trials or (), changes or ())
    read, asked = wished(FitWish([scene], *words), Findings())
    extra = {n: getattr(asked, n) for n in ("runs", "own", "bounds", "priors", "level", "candidates", "trials")}
    more: dict[str, Any] = {"budget": budget, "label": label, "tags": tag or [], "idempotency_key": idempotency_key}
    made = Connection(s := Server(server, key)).fit(read, asked.shared, **extra, **more)
    end = _followed(s, made.id) if wait else made.document
    if wait and not as_json:
        print_lines(answer_lines(made))
    else:
        print_json(end | ({"answer": made.answer} if wait else {})) if as_json else print(made.id)
    raise typer.Exit(FAILED if wait and end["state"] != "done" else DONE)


@app.command()
def answer(job: Id, server: Url = HERE, key: Secret = "", as_json: AsJson = False) -> None:
    """What a fit or a study has found so far."""
    from engine.cli.charting import print_lines

    there = Connection(Server(server, key)).job(job)
    found = there.answer
    print_json(found or {}) if as_json or (found and found["kind"] != "fit") else print_lines(answer_lines(there))


@app.command("list")
def list_jobs(
    state: Annotated[str | None, typer.Option(metavar="STATE", help="Only jobs in this state.")] = None,
    tag: Annotated[str | None, typer.Option(metavar="TAG", help="Only jobs with this tag.")] = None,
    search: Annotated[str | None, typer.Option(metavar="TEXT", help="Only jobs with this in label, tags, scene or id.")] = None,
    limit: Annotated[int, typer.Option(metavar="N", min=1, max=500)] = 20,
    server: Url = HERE,
    key: Secret = "",
    as_json: AsJson = False,
) -> None:
    """List the newest jobs."""
    asked = {k: v for k, v in (("state", state), ("tag", tag), ("search", search)) if v}
    answer = Server(server, key).ask("GET", "/v1/jobs", params={"limit": limit} | asked).json()
    print_json(answer) if as_json else print("\n".join(map(_line, answer["jobs"])) or "no jobs")


@app.command()
def show(job: Id, server: Url = HERE, key: Secret = "", as_json: AsJson = False) -> None:
    """A job: state, progress, outcomes, what went wrong."""
    found = Server(server, key).ask("GET", f"/v1/jobs/{job}").json()
    print_json(found) if as_json else _told(found)


@app.command()
def watch(job: Id, server: Url = HERE, key: Secret = "", as_json: AsJson = False) -> None:
    """Follow a job until it has ended (exit code 1 when it failed)."""
    end = _followed(Server(server, key), job)
    print_json(end) if as_json else _told(end)
    raise typer.Exit(DONE if end["state"] == "done" else FAILED)


@app.command()
def cancel(job: Id, server: Url = HERE, key: Secret = "", as_json: AsJson = False) -> None:
    """Cancel a job; rows computed so far are kept."""
    found = Server(server, key).ask("DELETE", f"/v1/jobs/{job}").json()
    print_json(found) if as_json else print(_line(found))


@app.command()
def rerun(
    job: Id,
    outcome: Annotated[list[str] | None, typer.Option(metavar="NAME", help="Only cases with this outcome (repeatable).")] = None,
    method: Annotated[str, typer.Option(metavar="M", help="Another method.")] = "",
    patience: Annotated[str, typer.Option(metavar="S", help="Other processor seconds that a case may take.")] = "",
    server: Url = HERE,
    key: Secret = "",
) -> None:
    """Run the cases of a job that failed again, as a new job; print its id."""
    body: dict[str, Any] = {k: v for k, v in (("method", method), ("patience", patience), ("outcomes", outcome)) if v}
    print(Server(server, key).ask("POST", f"/v1/jobs/{job}/rerun", json=body).json()["id"])


@app.command()
def delete(job: Id, server: Url = HERE, key: Secret = "") -> None:
    """Delete a job that has ended, with all its results."""
    Server(server, key).ask("DELETE", f"/v1/jobs/{job}", params={"purge": "true"})
    print(f"deleted {job}")


@app.command()
def results(
    job: Id,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help=".csv, .parquet, .arrows or .json.")],
    case: Annotated[int | None, typer.Option(metavar="N", help="All rows of one case instead.")] = None,
    rows: Annotated[bool, typer.Option("--rows", help="The rows kept of all cases instead (see submit --trajectories).")] = False,
    certify: Annotated[bool, typer.Option("--certify", help="With --case: each column's global error beside it.")] = False,
    server: Url = HERE,
    key: Secret = "",
) -> None:
    """Fetch a job's table, the trajectory of one case, or the rows kept of all."""
    kind = {".csv": "csv", ".parquet": "parquet", ".arrows": "arrow", ".json": "json"}.get(output.suffix.lower())
    if kind is None:
        raise SceneError(
            [Problem("-o", f"{str(output)!r} does not say what to write", "end it in .csv, .parquet, .arrows or .json")]
        )
    if rows and case is not None:
        raise SceneError([Problem("--rows", "--case asks for something else", "keep one of them")])
    what = "trajectories" if rows else "results" if case is None else f"cases/{case}/trajectory"
    path = f"/v1/jobs/{job}/{what}"
    Server(server, key).save(path, output, params={"format": kind} | ({"certify": "true"} if certify and case is not None else {}))
    print(f"wrote {output}")


def _followed(s: Server, job: str) -> dict[str, Any]:
    """Poll a job until it has ended, with a bar on a terminal."""
    from engine.cli.progress import Watch

    try:
        with Watch(f"job {job[:8]}") as bar:
            while True:
                now: dict[str, Any] = s.ask("GET", f"/v1/jobs/{job}").json()
                bar.tell(now["done"] + now["lost"], now["cases"])
                if now["state"] in ENDED:
                    return now
                time.sleep(0.5)
    except KeyboardInterrupt:
        raise SimulationError(f"no longer followed; the job goes on: trunnion jobs watch {job}, or cancel {job}") from None


def _line(job: dict[str, Any]) -> str:
    outcomes = ", ".join(f"{n} {name}" for name, n in job["outcomes"].items())
    said = f"{job['id']}  {job['state']:<10} {job['done']}/{job['cases']}  {job['scene']}"
    return said + (f"  ({outcomes})" if outcomes else "") + (f"  {job['label']}" if job["label"] else "")


def _told(job: dict[str, Any]) -> None:
    """Print a job as text; what went wrong goes to standard error."""
    print(_line(job))
    if job["state"] == "running" and job["eta_seconds"] is not None:
        print(f"about {job['eta_seconds']:.0f} s to go")
    for p in job["problems"]:
        print(Problem(**p), file=sys.stderr)


__all__ = ["Connection", "Job", "app", "checked", "connect", "problems_of"]
