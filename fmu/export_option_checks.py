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
    """Problems of the requested standard and type, and of options that exclude each other. sources: the name of the kernel if C
    sources are requested, else None. certify: whether error estimates are requested. scalars: whether the FMU must not have
    arrays."""
    wrong = [] if parameters is None else destination_problems(str(parameters), (".ssv",), "--parameters-file")
    exchange = kind in KINDS and does(kind, "me")
    checks = (
        (fmi not in STANDARDS, "--fmi", f"{fmi!r} is not a supported version of FMI", "2 or 3"),
        (flavour == "python" and fmi == 3, "--flavour", "pythonfmu writes FMI 2.0 only", "choose --flavour native, or --fmi 2"),
        (flavour == "python" and exchange, "--flavour", "pythonfmu writes co-simulation only",
         "choose --flavour native, or --type cs"),
        (sources is not None and flavour == "python", "--sources", "an FMU of the python flavour has no C sources",
         "--flavour native"),
        (sources == "parts", "--sources", "a model made of parts has no C sources", "--kernel compiled"),
        (parameters is not None and fmi == 3 and not scalars, "--parameters-file", "SSV 1.0 has no arrays",
         "--scalars, or --fmi 2"),
        (scalars and fmi != 3, "--scalars", "FMI 2.0 has only scalars", "omit --scalars, or choose --fmi 3"),
        (certify and (flavour == "python" or kind != "cs"), "--certify",
         "only native FMUs for co-simulation can report errors", "--flavour native, --type cs"),
        (kind == "me" and step > 0.0, "--step", "in model exchange, the importing tool's solver makes the steps",
         "omit --step, or choose --type cs"),
    )  # fmt: skip
    return wrong + [Problem(where, what, hint) for is_wrong, where, what, hint in checks if is_wrong]


def check(flavour: str, kernel: str, kind: str, target: Path, step: float, before: Sequence[Problem]) -> None:
    """Raise SceneError with all problems of an export. before: problems found earlier."""
    problems = [*before, *destination_problems(str(target), (".fmu",), "-o")]
    checks = (
        (flavour not in FLAVOURS, "--flavour", f"{flavour!r} is not a flavour", f"one of {', '.join(FLAVOURS)}"),
        (kernel not in ALONE, "--kernel", f"{kernel!r} is not a kernel", f"one of {', '.join(ALONE)}"),
        (kind not in KINDS, "--type", f"{kind!r} is not a type of FMU", f"one of {', '.join(KINDS)}"),
        (not 0.0 <= step < float("inf"), "--step", f"{step:g} is not a step", "a time such as 1 ms, or 0 for error control"),
    )
    raise_problems(problems + [Problem(where, what, hint) for is_wrong, where, what, hint in checks if is_wrong])
