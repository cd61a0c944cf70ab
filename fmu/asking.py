"""What can be asked of an export, and what is wrong with what is asked."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from engine.basics.files import destination_problems
from engine.basics.problems import Problem, SceneError
from engine.simulation.settings import ALONE
from fmu.exchange import KINDS, does

FLAVOURS = ("native", "python")
STANDARDS = {2: "2.0", 3: "3.0"}
"""Versions of FMI by what a user calls them."""


def apart(
    flavour: str | None, fmi: int, parameters: str | Path | None, kind: str | None = "cs", step: float = 0.0,
    sources: str | None = None, certify: bool = False,
) -> list[Problem]:
    """What is wrong with the standard and the kind that are asked for, and does not go with them. sources: the kernel, where
    sources are asked for; certify: whether errors are."""
    wrong = [] if parameters is None else destination_problems(str(parameters), (".ssv",), "--parameters-file")
    exchange = kind in KINDS and does(kind, "me")
    if fmi not in STANDARDS:
        wrong.append(Problem("--fmi", f"{fmi!r} is no version of FMI that FMUs are made for", "2 or 3"))
    if flavour == "python" and fmi == 3:
        wrong.append(Problem("--flavour", "pythonfmu writes FMI 2.0 only", "--flavour native, or --fmi 2"))
    if flavour == "python" and exchange:
        wrong.append(Problem("--flavour", "pythonfmu writes co-simulation only", "--flavour native, or --type cs"))
    if sources is not None and flavour == "python":
        wrong.append(Problem("--sources", "the python flavour has none", "--flavour native"))
    if sources == "parts":
        wrong.append(Problem("--sources", "a model made of parts has none", "--kernel compiled"))
    if parameters is not None and fmi == 3:
        wrong.append(Problem("--parameters-file", "SSV 1.0 has no arrays", "--fmi 2"))
    if certify and (flavour == "python" or kind != "cs"):
        wrong.append(Problem("--certify", "errors are told by native FMUs for co-simulation", "--flavour native, --type cs"))
    if kind == "me" and step > 0.0:
        wrong.append(Problem("--step", "in model exchange the importer's solver makes the steps", "no --step, or --type cs"))
    return wrong


def check(flavour: str, kernel: str, kind: str, target: Path, step: float, before: Sequence[Problem]) -> None:
    """SceneError with all that is wrong with an export. before: what has been found already."""
    problems = [*before, *destination_problems(str(target), (".fmu",), "-o")]
    if flavour not in FLAVOURS:
        problems.append(Problem("--flavour", f"{flavour!r} is no flavour", f"one of {', '.join(FLAVOURS)}"))
    if kernel not in ALONE:
        problems.append(Problem("--kernel", f"{kernel!r} is no kernel", f"one of {', '.join(ALONE)}"))
    if kind not in KINDS:
        problems.append(Problem("--type", f"{kind!r} is nothing an FMU can be for", f"one of {', '.join(KINDS)}"))
    if not 0.0 <= step < float("inf"):
        problems.append(Problem("--step", f"{step:g} is not a step", "a time such as 1 ms, or 0 for error control"))
    if problems:
        raise SceneError(problems)
