"""The options of ``trunnion serve``, and readers of their values."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any

import typer

from trunnion.basics.problems import Problem, SceneError
from trunnion.basics.renamed_words import SETTINGS, current
from trunnion.service.basics.server_settings import Certificates, Limits


def pem(what: str, name: str) -> Any:
    """The option for a PEM file that a scheduler with a tls:// address needs. what: content of the file. name: end of the
    environment variable's name."""
    return typer.Option(metavar="FILE", help=f"With a tls:// scheduler: {what} (PEM).", envvar=f"TRUNNION_SCHEDULER_{name}")


def from_environment(name: str, metavar: str, text: str, default: str | bool = True) -> Any:
    """An option that the environment variable ``TRUNNION_NAME`` also sets. text: help text. default: description of the default."""
    return typer.Option(metavar=metavar, help=text, show_default=default, envvar=f"TRUNNION_{name}")


def limit_names() -> list[str]:
    """The names of all limits whose values are numbers."""
    return [f.name for f in fields(Limits) if f.name != "rate"]


Data = Annotated[Path, from_environment("DATA", "DIR", "Folder of the database, results and scratch files.")]
Host = Annotated[
    str,
    typer.Option(
        metavar="HOST", help="Address at which the server listens; addresses other than this machine's own require API keys."
    ),
]
Database = Annotated[
    str, from_environment("DATABASE", "URL", "Address of the database: postgresql://… or sqlite:///file.", "a file in DIR")
]
Results = Annotated[str, from_environment("RESULTS", "URL", "Place of the results: a folder or an fsspec URL.", "a folder in DIR")]
Scheduler = Annotated[
    str,
    from_environment("SCHEDULER", "ADDRESS", "Address of a Dask scheduler, such as tls://host:8786.", "processes of this machine"),
]
CaFile = Annotated[Path | None, pem("certificate of the authority that signed the scheduler's certificate", "CA")]
CertFile = Annotated[Path | None, pem("this server's certificate", "CERT")]
KeyFile = Annotated[Path | None, pem("private key of this server's certificate", "KEY")]
LimitWords = Annotated[
    list[str], typer.Option("--limit", metavar="NAME=N", help=f"Set a limit: {', '.join(limit_names())}.", default_factory=list)
]
Keep = Annotated[str, from_environment("KEEP", "TIME", "Delete a job this long after its end: 30d, 12h.", "never")]
Webhooks = Annotated[
    list[str],
    typer.Option(
        "--webhook", metavar="URL",
        help="Allow jobs to report their end to addresses that begin with this URL.", default_factory=list,
        envvar="TRUNNION_WEBHOOK",
    ),
]  # fmt: skip
NewKey = Annotated[
    str,
    typer.Option(
        "--new-key",
        metavar="NAME:ROLE",
        help="Create and print an API key, without starting the server; ROLE: read, submit or admin.",
    ),
]


def certificates_of(scheduler: str, *files: Path | None) -> Certificates | None:
    """The certificates for the scheduler; None if no file is given, so that Dask's own configuration applies. SceneError with all
    mistakes."""
    options = ("--scheduler-ca", "--scheduler-cert", "--scheduler-key")
    given = [f for f in files if f is not None]
    if not given:
        return None
    missing = [o for o, f in zip(options, files, strict=True) if f is None]
    problems = [Problem(o, "is not given", f"give all of {', '.join(options)}, or none of them") for o in missing]
    problems += [Problem(o, f"there is no file {str(f)!r}") for o, f in zip(options, files, strict=True) if f and not f.is_file()]
    if not scheduler.startswith("tls://"):
        problems.append(Problem("--scheduler", f"{scheduler!r} is not a tls:// address", "such as tls://host:8786"))
    if problems:
        raise SceneError(problems)
    return Certificates(*given)


def limits_of(rate: str, texts: list[str]) -> Limits:
    """The limits that the options set. rate: value of ``--rate``. texts: values of ``--limit``. SceneError with all mistakes."""
    from trunnion.service.api.transport.api_keys_and_rates import Rates

    problems, given = [], {}
    try:
        Rates(rate)
    except ValueError:
        problems.append(Problem("--rate", f"{rate!r} is not a rate", "such as 1200/minute or 20/second"))
    for text in texts:
        name, _, value = text.partition("=")
        name = current("limit", SETTINGS, name)
        try:
            given[name] = type(getattr(Limits, name) if name in limit_names() else 0)(float(value))
        except (ValueError, OverflowError):
            problems.append(Problem("--limit", f"{text!r} is not NAME=N", "such as cases=100000"))
        if name not in limit_names():
            problems.append(Problem("--limit", f"there is no limit {name!r}", f"one of {', '.join(limit_names())}"))
    if problems:
        raise SceneError(problems)
    return Limits(rate=rate, **given)


KEPT_UNITS = {"s": 1.0, "m": 60.0, "h": 3600.0, "d": 86_400.0}


def kept_for(text: str) -> float:
    """The seconds in a time such as 30d, 12h or 0. SceneError for any other text."""
    number, unit = (text[:-1], text[-1:]) if text[-1:] in KEPT_UNITS else (text, "s")
    try:
        seconds = float(number or "0") * KEPT_UNITS[unit]
    except ValueError:
        seconds = -1.0
    if not 0.0 <= seconds < float("inf"):
        raise SceneError([Problem("--keep", f"{text!r} is not a time", "such as 30d, 12h or 45m")])
    return seconds
