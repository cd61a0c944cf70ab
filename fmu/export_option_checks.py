"""Checks of export options."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from trunnion.basics.atomic_files import destination_problems
from trunnion.basics.errors import Problem, raise_problems
from trunnion.fmu.variables.model_exchange_states import KINDS, does
from trunnion.simulation.settings.run_settings import ALONE

FLAVOURS = ("native", "python")
STANDARDS = {2: "2.0", 3: "3.0"}
"""FMI version by value of the option ``--fmi``."""


def apart(
    flavour: str | None,
    fmi: int,
    parameters: str | Path | None,
    kind: str | None = "cs",
    step: float = 0.0,
    sources: str | None = None,
    certify: bool = False,
    scalars: bool = False,
) -> list[Problem]:
    """Problems of the requested standard and type, and of options that exclude each other. sources: the kernel, if C sources are
    requested, else None. certify: whether error estimates are requested. scalars: whether arrays are excluded."""
    wrong = [] if parameters is None else destination_problems(str(parameters), (".ssv",), "--parameters-file")
    exchange = kind in KINDS and does(kind, "me")
    if fmi not in STANDARDS:
        wrong.append(Problem("--fmi", f"{fmi!r} is not a supported version of FMI", "2 or 3"))
    if flavour == "python" and fmi == 3:
        wrong.append(Problem("--flavour", "pythonfmu writes FMI 2.0 only", "choose --flavour native, or --fmi 2"))
    if flavour == "python" and exchange:
        wrong.append(Problem("--flavour", "pythonfmu writes co-simulation only", "choose --flavour native, or --type cs"))
    if sources is not None and flavour == "python":
        wrong.append(Problem("--sources", "an FMU of the python flavour has no C sources", "--flavour native"))
    if sources == "parts":
        wrong.append(Problem("--sources", "a model made of parts has no C sources", "--kernel compiled"))
    if parameters is not None and fmi == 3 and not scalars:
        wrong.append(Problem("--parameters-file", "SSV 1.0 has no arrays", "--scalars, or --fmi 2"))
    if scalars and fmi != 3:
        wrong.append(Problem("--scalars", "FMI 2.0 has only scalars", "omit --scalars, or choose --fmi 3"))
    if certify and (flavour == "python" or kind != "cs"):
        wrong.append(Problem("--certify", "only native FMUs for co-simulation can report errors", "--flavour native, --type cs"))
    if kind == "me" and step > 0.0:
        wrong.append(
            Problem("--step", "in model exchange, the importing tool's solver makes the steps", "omit --step, or choose --type cs")
        )
    return wrong


def check(flavour: str, kernel: str, kind: str, target: Path, step: float, before: Sequence[Problem]) -> None:
    """Raise SceneError with all problems of an export. before: problems found earlier."""
    problems = [*before, *destination_problems(str(target), (".fmu",), "-o")]
    if flavour not in FLAVOURS:
        problems.append(Problem("--flavour", f"{flavour!r} is not a flavour", f"one of {', '.join(FLAVOURS)}"))
    if kernel not in ALONE:
        problems.append(Problem("--kernel", f"{kernel!r} is not a kernel", f"one of {', '.join(ALONE)}"))
    if kind not in KINDS:
        problems.append(Problem("--type", f"{kind!r} is not a type of FMU", f"one of {', '.join(KINDS)}"))
    if not 0.0 <= step < float("inf"):
        problems.append(Problem("--step", f"{step:g} is not a step", "a time such as 1 ms, or 0 for error control"))
    raise_problems(problems)
