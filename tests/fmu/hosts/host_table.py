"""FMUs of all bundled models in all forms in other tools: ``python -m tests.fmu.hosts.host_table FOLDER [TOOL ...]`` prints the
figures for the table of fmu/README.md.

FOLDER keeps an environment for each tool, and in one folder for each commit the FMUs and the values from each tool. A run that was
interrupted continues where it stopped. Tools in C are used if they are on the path. PyFMI, which is compiled with its libraries, is
used if FOLDER has an environment with it. A cell is the largest difference of a final value from the value in
fmpy, relative to 1 or to the value, whichever is larger. If the tool refuses files, the cell has the last line of each refusal,
with the models."""

from __future__ import annotations

import csv
import json
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import venv
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tests.fmu.hosts.other_tools import MARK, PROCESSOR_SECONDS, Values
from trunnion.fmu.scene_export import export
from trunnion.scene.library.model_folders import bundled_names

MODELS = tuple(bundled_names())
FORMS: dict[str, dict[str, Any]] = {
    "cs2": {"sources": True}, "python2": {"flavour": "python"}, "me2": {"kind": "me"},
    "arrays3": {"fmi": 3, "sources": True}, "scalars3": {"fmi": 3, "scalars": True}, "me3": {"fmi": 3, "kind": "me"},
    "mescalars3": {"fmi": 3, "kind": "me", "scalars": True},
}  # fmt: skip
TOOLS = {
    "fmpy": ("fmpy==0.3.32",), "libcosim": ("libcosimpy==0.0.6", "fmpy==0.3.32"),
    "ecos": ("ecospy==0.7.2", "fmpy==0.3.32"), "cofmupy": ("cofmupy==1.0.0",),
    "container": ("fmu-manipulation-toolbox==2.0", "fmpy==0.3.32"), "casadi": ("casadi==3.8.2", "fmpy==0.3.32"),
    "fmuloader": ("fmuloader==0.1.2rc0", "fmpy==0.3.32"), "pathsim": ("pathsim-fmi==0.1.1", "pathsim==0.27.1", "fmpy==0.3.32"),
    "sofirpy": ("sofirpy==1.0.2", "fmpy==0.3.32"), "syssimx": ("syssimx==0.4.3", "fmpy==0.3.32"),
    "pycosim": ("PyCosimLibrary==0.0.5", "fmpy==0.2.14", "setuptools"),
    "energysim": ("energysim==2.1.9.1", "fmpy==0.2.14", "pypsa==0.31.2"), "pyfmi": (),
    "bd2cmake": ("fmi-bd2cmake==0.1.0", "fmpy==0.3.32", "cmake==4.4.5"), "fmpy_compiled": ("fmpy==0.3.32", "cmake==4.4.5"),
}  # fmt: skip
FORMS_OF = {"casadi": ("me2", "me3", "mescalars3"), "fmpy_compiled": ("cs2", "arrays3"), "bd2cmake": ("arrays3",)}
"""The forms of FMUs that a tool accepts, if the tool does not accept all forms."""
PROGRAMS = {"fmuCheck.linux64": ("cs2", "me2", "python2"), "fmi4ctest": tuple(FORMS)}
STOP, STEP = 0.9, 0.01
"""Seconds. At 1 s the motions of `robot_arm` end, and its friction jumps."""
SECONDS, TIMEOUT = 600, 124
DIFFERENCE = "difference"


def values_in(tool: str, folder: Path, files: Sequence[Path]) -> list[Values | str]:
    """For each file, the final values of the outputs in a tool, or the last line of its refusal. A process runs file
    after file. If a file ends the process, another process runs the files after it."""
    if tool in PROGRAMS:
        return [_of_program(tool, file) for file in files]
    place = folder / tool
    if not place.exists():
        venv.create(place, with_pip=True)
        subprocess.run([place / "bin" / "pip", "install", "-q", *TOOLS[tool]], check=True)
    words = [place / "bin" / "python", "-W", "ignore", Path(__file__).with_name("other_tools.py"), tool, STOP, STEP]
    out: list[Values | str] = []
    while len(out) < len(files):
        left = files[len(out) :]
        told = _run([*map(str, [*words, *left])], SECONDS * len(left))
        out += [json.loads(line.removeprefix(MARK)) for line in told.stdout.splitlines() if line.startswith(MARK)]
        if len(out) < len(files):
            out.append(_end(told))
    return out


def _run(words: list[str], seconds: float) -> subprocess.CompletedProcess[str]:
    """The finished process. Its return code is TIMEOUT if it does not end within the given time."""
    try:
        return subprocess.run(words, capture_output=True, text=True, timeout=seconds, check=False)
    except subprocess.TimeoutExpired as e:
        return subprocess.CompletedProcess(words, TIMEOUT, (e.stdout or b"").decode(), "")


def _end(told: subprocess.CompletedProcess[str]) -> str:
    """The reason for which a process ended."""
    if told.returncode == TIMEOUT:
        return "does not end"
    if told.returncode == -signal.SIGPROF:
        return f"needs more than {PROCESSOR_SECONDS} s of processor time"
    if told.returncode < 0:
        return f"the process ends by signal {-told.returncode}"
    return [*told.stdout.splitlines(), *told.stderr.splitlines(), "no message"][-2:][0]


def _of_program(tool: str, file: Path) -> Values | str:
    """The final values from a C program, which writes a CSV file; no values if the program writes no file."""
    rows = Path(tempfile.mkdtemp()) / "rows.csv"
    mode = "me" if file.stem.rpartition("-")[2].startswith("me") else "cs"
    options = {"fmuCheck.linux64": ["-k", mode, "-h", str(STEP), "-s", str(STOP), "-n", "0"],
               "fmi4ctest": ["-m", mode, "-h", str(STEP), "-s", str(STOP)]}[tool]  # fmt: skip
    told = _run([tool, *options, "-o", str(rows), str(file)], SECONDS)
    if told.returncode:
        return _end(told)
    if not rows.exists():
        return {}
    with rows.open() as f:
        *_, last = csv.DictReader(f)
    return {n.strip(): float(x) for n, x in last.items() if n and x and n.strip() != "time"}


def difference(a: Values, b: Values) -> float:
    """The largest difference of values that both results contain, relative to 1 or the value."""
    if DIFFERENCE in a:
        return a[DIFFERENCE]
    both = a.keys() & b.keys()
    return max(abs(a[n] - b[n]) / max(1.0, abs(b[n])) for n in both) if both else float("nan")


def files(folder: Path) -> dict[tuple[str, str], Path]:
    """The FMUs by model and form, in a folder. The function creates a missing folder."""
    folder.mkdir(parents=True, exist_ok=True)
    made = {(m, f): folder / f"{m}-{f}.fmu" for m in MODELS for f in FORMS}
    for (model, form), file in made.items():
        if not file.exists():
            export(model, file, **FORMS[form])
    return made


def commit() -> str:
    """The commit of the working tree; its name ends with "-dirty" if files were changed."""
    told = subprocess.run(["git", "describe", "--always", "--dirty"], capture_output=True, text=True, check=True)
    return told.stdout.strip()


def kept_values(tool: str, form: str, folder: Path, made: Mapping[tuple[str, str], Path]) -> list[Values | str]:
    """``values_in`` for one form of all models. The values are read from a file if a previous run of this commit wrote them."""
    given = [made[m, form] for m in MODELS]
    place = given[0].parent / f"{tool}-{form}.json"
    if not place.exists():
        place.write_text(json.dumps(values_in(tool, folder, given)))
    read: list[Values | str] = json.loads(place.read_text())
    return read


def cells(folder: Path, only: Sequence[str] = ()) -> Iterator[tuple[str, str, str]]:
    """(tool, form, cell) for all forms, and all tools or the tools in ``only``."""
    made = files(folder / commit())
    right = {f: kept_values("fmpy", f, folder, made) for f in FORMS}
    for tool in [t for t in (*TOOLS, *PROGRAMS) if not only or t in only]:
        if not (shutil.which(tool) if tool in PROGRAMS else TOOLS[tool] or (folder / tool).exists()):
            continue
        for form in (PROGRAMS | FORMS_OF).get(tool, tuple(FORMS)):
            got = kept_values(tool, form, folder, made)
            same = right["cs2"] if tool == "fmpy" else right[form]
            ran = [not isinstance(v, str) for v in got]
            pairs = zip(MODELS, got, same, strict=True)
            worst = {m: difference(v, w) for m, v, w in pairs if not isinstance(v, str) and not isinstance(w, str)}
            most = max(worst, key=lambda m: np.nan_to_num(worst[m], nan=-1.0), default="")
            reasons = dict.fromkeys(v for v in got if isinstance(v, str))
            refused = [f"{', '.join(m for m, v in zip(MODELS, got, strict=True) if v == why)}: {why}" for why in reasons]
            largest = f", largest difference {worst[most]:.1e} ({most})" if most else ""
            yield tool, form, "; ".join([f"{sum(ran)} of {len(MODELS)}{largest}", *refused])


if __name__ == "__main__":
    print(f"{len(MODELS) * len(FORMS)} FMUs of commit {commit()}; the seconds are processor time", flush=True)
    before = 0.0
    for tool, form, cell in cells(Path(sys.argv[1]).resolve(), sys.argv[2:]):
        now = sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])
        print(f"{tool:18s} {form:10s} {now - before:6.1f} s  {cell}", flush=True)
        before = now
