"""Options of ``trunnion serve``: what they are called, and how their words are read."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import typer

from engine.basics.problems import Problem, SceneError
from service.settings import Certificates, Limits

DATA = typer.Option(metavar="DIR", help="Folder for the database, results and scratch files.", envvar="TRUNNION_DATA")
HOST = typer.Option(metavar="HOST", help="Address to listen on; other than this machine's own, keys are needed.")
DATABASE = typer.Option(metavar="URL", help="postgresql://…, or sqlite:///file (default: in DIR).", envvar="TRUNNION_DATABASE")
RESULTS = typer.Option(metavar="URL", help="Folder or fsspec URL for results (default: in DIR).", envvar="TRUNNION_RESULTS")
KEEP = typer.Option(metavar="TIME", help="Delete jobs that ended so long ago: 30d, 12h (default: never).", envvar="TRUNNION_KEEP")
WEBHOOK = typer.Option(
    metavar="URL",
    help="Ends of jobs may be told to addresses below this one (repeatable; default: none).",
    envvar="TRUNNION_WEBHOOK",
)
NEW_KEY = typer.Option("--new-key", metavar="NAME:ROLE", help="Make a key (read, submit, admin), print it, and end.")
SCHEDULER = typer.Option(
    metavar="ADDRESS", help="Dask scheduler, such as tls://host:8786 (default: processes here).", envvar="TRUNNION_SCHEDULER"
)


def pem(what: str, name: str) -> Any:
    """The option for a file that a scheduler with a tls:// address asks for."""
    return typer.Option(metavar="FILE", help=f"With a tls:// scheduler: {what} (PEM).", envvar=f"TRUNNION_SCHEDULER_{name}")


def certificates_of(scheduler: str, *files: Path | None) -> Certificates | None:
    """What to show a scheduler, None when nothing is given (Dask's own configuration holds then); SceneError with every problem."""
    options = ("--scheduler-ca", "--scheduler-cert", "--scheduler-key")
    given = [f for f in files if f is not None]
    if not given:
        return None
    missing = [o for o, f in zip(options, files, strict=True) if f is None]
    problems = [Problem(o, "is not given", f"all of {', '.join(options)}, or none") for o in missing]
    problems += [Problem(o, f"there is no file {str(f)!r}") for o, f in zip(options, files, strict=True) if f and not f.is_file()]
    if not scheduler.startswith("tls://"):
        problems.append(Problem("--scheduler", f"{scheduler!r} is no tls:// address", "such as tls://host:8786"))
    if problems:
        raise SceneError(problems)
    return Certificates(*given)


def limit_names() -> list[str]:
    """Names of the limits that are numbers."""
    return [f.name for f in fields(Limits) if f.name != "rate"]


def limits_of(rate: str, texts: list[str]) -> Limits:
    """The limits that the options set; SceneError with every problem."""
    from service.api.security import Rates

    problems, given = [], {}
    try:
        Rates(rate)
    except ValueError:
        problems.append(Problem("--rate", f"{rate!r} is no rate", "such as 1200/minute or 20/second"))
    for text in texts:
        name, _, value = text.partition("=")
        try:
            given[name] = type(getattr(Limits, name) if name in limit_names() else 0)(float(value))
        except (ValueError, OverflowError):
            problems.append(Problem("--limit", f"{text!r} is not NAME=N", "such as cases=100000"))
        if name not in limit_names():
            problems.append(Problem("--limit", f"there is no limit {name!r}", f"one of {', '.join(limit_names())}"))
    if problems:
        raise SceneError(problems)
    return Limits(rate=rate, **given)


def kept_for(text: str) -> float:
    """Seconds of a time such as 30d, 12h or 0; SceneError for anything else."""
    number, unit = (text[:-1], text[-1:]) if text[-1:] in KEPT_UNITS else (text, "s")
    try:
        seconds = float(number or "0") * KEPT_UNITS[unit]
    except ValueError:
        seconds = -1.0
    if not 0.0 <= seconds < float("inf"):
        raise SceneError([Problem("--keep", f"{text!r} is no time", "such as 30d, 12h or 45m")])
    return seconds


KEPT_UNITS = {"s": 1.0, "m": 60.0, "h": 3600.0, "d": 86_400.0}


LIMIT = typer.Option(metavar="NAME=N", help="Another limit: " + ", ".join(limit_names()) + " (repeatable).")
