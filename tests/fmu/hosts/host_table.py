"""FMUs of eight models in all forms in other tools: ``python -m tests.fmu.hosts.host_table FOLDER`` prints what the table of
fmu/README.md summarises.

FOLDER keeps the FMUs and an environment for each tool. Tools in C are used if they are on the path. A cell is the largest
difference of a final value from that in fmpy, relative to 1 or the value, whichever is larger. If the tool refuses the file, the
cell is the last line of its refusal."""

from __future__ import annotations

import csv
import json
import shutil
import subprocess
import sys
import tempfile
import venv
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tests.fmu.hosts.other_tools import MARK, Values
from trunnion.fmu.scene_export import export

MODELS = ("spherical_pendulum", "crank_slider", "n_four_bar", "double_pendulum", "simple_pendulum", "governor", "andrews",
          "cart_pole")  # fmt: skip
FORMS: dict[str, dict[str, Any]] = {
    "cs2": {"sources": True}, "python2": {"flavour": "python"}, "me2": {"kind": "me"},
    "arrays3": {"fmi": 3, "sources": True}, "scalars3": {"fmi": 3, "scalars": True}, "me3": {"fmi": 3, "kind": "me"},
}  # fmt: skip
TOOLS = {
    "fmpy": ("fmpy==0.3.32",), "libcosim": ("libcosimpy==0.0.6", "fmpy==0.3.32"),
    "ecos": ("ecospy==0.7.2", "fmpy==0.3.32"), "cofmupy": ("cofmupy==1.0.0",),
    "container": ("fmu-manipulation-toolbox==2.0", "fmpy==0.3.32"), "casadi": ("casadi==3.8.2", "fmpy==0.3.32"),
    "fmuloader": ("fmuloader==0.1.2rc0", "fmpy==0.3.32"), "pathsim": ("pathsim-fmi==0.1.1", "pathsim==0.27.1", "fmpy==0.3.32"),
    "fmpy_compiled": ("fmpy==0.3.32", "cmake==4.4.5"),
}  # fmt: skip
PROGRAMS = {"fmuCheck.linux64": ("cs2", "me2", "python2"), "fmi4ctest": tuple(FORMS)}
STOP, STEP = 1.0, 0.01
SECONDS, TIMEOUT = 1200, 124
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
        told = _run([*map(str, [*words, *files[len(out) :]])])
        out += [json.loads(line.removeprefix(MARK)) for line in told.stdout.splitlines() if line.startswith(MARK)]
        if len(out) < len(files):
            out.append(_end(told))
    return out


def _run(words: list[str]) -> subprocess.CompletedProcess[str]:
    """The finished process; its return code is TIMEOUT if it does not end."""
    try:
        return subprocess.run(words, capture_output=True, text=True, timeout=SECONDS, check=False)
    except subprocess.TimeoutExpired as e:
        return subprocess.CompletedProcess(words, TIMEOUT, (e.stdout or b"").decode(), "")


def _end(told: subprocess.CompletedProcess[str]) -> str:
    """Why a process ended."""
    if told.returncode == TIMEOUT:
        return "does not end"
    if told.returncode < 0:
        return f"the process ends by signal {-told.returncode}"
    return [*told.stdout.splitlines(), *told.stderr.splitlines(), "no message"][-2:][0]


def _of_program(tool: str, file: Path) -> Values | str:
    """The final values by a program in C, which writes a CSV file; none if it writes no file."""
    rows = Path(tempfile.mkdtemp()) / "rows.csv"
    mode = "me" if file.stem.rpartition("-")[2].startswith("me") else "cs"
    options = {"fmuCheck.linux64": ["-k", mode, "-h", str(STEP), "-s", str(STOP), "-n", "0"],
               "fmi4ctest": ["-m", mode, "-h", str(STEP), "-s", str(STOP)]}[tool]  # fmt: skip
    told = _run([tool, *options, "-o", str(rows), str(file)])
    if told.returncode:
        return _end(told)
    if not rows.exists():
        return {}
    with rows.open() as f:
        *_, last = csv.DictReader(f)
    return {n.strip(): float(x) for n, x in last.items() if n and x and n.strip() != "time"}


def difference(a: Values, b: Values) -> float:
    """The largest difference of values that both have, relative to 1 or the value."""
    if DIFFERENCE in a:
        return a[DIFFERENCE]
    both = a.keys() & b.keys()
    return max(abs(a[n] - b[n]) / max(1.0, abs(b[n])) for n in both) if both else float("nan")


def files(folder: Path) -> dict[tuple[str, str], Path]:
    """The FMUs by model and form, in a folder that is made if it is missing."""
    folder.mkdir(parents=True, exist_ok=True)
    made = {(m, f): folder / f"{m}-{f}.fmu" for m in MODELS for f in FORMS}
    for (model, form), file in made.items():
        if not file.exists():
            export(model, file, **FORMS[form])
    return made


def cells(folder: Path) -> Iterator[tuple[str, str, str]]:
    """(tool, form, cell) for all tools and forms."""
    made = files(folder)
    right = {f: values_in("fmpy", folder, [made[m, f] for m in MODELS]) for f in FORMS}
    for tool in [*(p for p in PROGRAMS if shutil.which(p)), *TOOLS]:
        for form in PROGRAMS.get(tool, tuple(FORMS)):
            if (tool == "casadi" and "me" not in form) or (tool == "fmpy_compiled" and "sources" not in FORMS[form]):
                continue
            got = right[form] if tool == "fmpy" else values_in(tool, folder, [made[m, form] for m in MODELS])
            same = right["cs2"] if tool == "fmpy" else right[form]
            both = [(v, w) for v, w in zip(got, same, strict=True) if not isinstance(v, str)]
            worst = [difference(v, w) for v, w in both if not isinstance(w, str)]
            refused = [f"{m}: {v}" for m, v in zip(MODELS, got, strict=True) if isinstance(v, str)]
            largest = f", largest difference {np.nanmax(worst):.1e}" if not np.all(np.isnan(worst)) else ""
            yield tool, form, "; ".join([f"{len(both)} of {len(MODELS)}{largest}", *refused])


if __name__ == "__main__":
    for tool, form, cell in cells(Path(sys.argv[1]).resolve()):
        print(f"{tool:18s} {form:9s} {cell}", flush=True)
