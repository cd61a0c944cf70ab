"""FMUs of eight models in all forms in other tools: ``python -m tests.fmu.hosts.host_table FOLDER`` prints what the table of
fmu/README.md summarises.

FOLDER keeps the FMUs and an environment for each tool. Tools in C are used if they are on the path. A cell is the largest
difference of a final value from that in fmpy, relative to 1 or the value, whichever is larger; or the last line of the tool's
refusal."""

from __future__ import annotations

import csv
import json
import shutil
import subprocess
import sys
import tempfile
import venv
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from trunnion.fmu.scene_export import export

MODELS = ("spherical_pendulum", "crank_slider", "n_four_bar", "double_pendulum", "simple_pendulum", "governor", "andrews",
          "cart_pole")  # fmt: skip
FORMS: dict[str, dict[str, Any]] = {
    "cs2": {"sources": True}, "python2": {"flavour": "python"}, "me2": {"kind": "me"},
    "arrays3": {"fmi": 3, "sources": True}, "scalars3": {"fmi": 3, "scalars": True}, "me3": {"fmi": 3, "kind": "me"},
}  # fmt: skip
TOOLS = {
    "fmpy": ("fmpy==0.3.32",), "fmpy_compiled": ("fmpy==0.3.32", "cmake==4.4.5"), "libcosim": ("libcosimpy==0.0.6", "fmpy==0.3.32"),
    "ecos": ("ecospy==0.7.2", "fmpy==0.3.32"), "cofmupy": ("cofmupy==1.0.0",),
    "container": ("fmu-manipulation-toolbox==2.0", "fmpy==0.3.32"), "casadi": ("casadi==3.8.2", "fmpy==0.3.32"),
    "fmuloader": ("fmuloader==0.1.2rc0", "fmpy==0.3.32"), "pathsim": ("pathsim-fmi==0.1.1", "pathsim==0.27.1", "fmpy==0.3.32"),
}  # fmt: skip
PROGRAMS = {"fmuCheck.linux64": ("cs2", "me2", "python2"), "fmi4ctest": tuple(FORMS)}
STOP, STEP = 1.0, 0.01
DIFFERENCE = "difference"
Values = dict[str, float]


def values_in(tool: str, folder: Path, file: Path, stop: float = STOP, step: float = STEP) -> Values | str:
    """The final values of the outputs of a file in a tool, or the last line of its refusal."""
    if tool in PROGRAMS:
        return _of_program(tool, file, stop, step)
    place = folder / tool
    if not place.exists():
        venv.create(place, with_pip=True)
        subprocess.run([place / "bin" / "pip", "install", "-q", *TOOLS[tool]], check=True)
    words = [str(place / "bin" / "python"), "-W", "ignore", str(Path(__file__).with_name("programs.py")), tool, str(file)]
    told = _run([*words, str(stop), str(step)])
    return told if isinstance(told, str) else {str(n): float(x) for n, x in json.loads(told.stdout.splitlines()[-1]).items()}


def _run(words: list[str]) -> subprocess.CompletedProcess[str] | str:
    """The finished process, or why it failed."""
    try:
        told = subprocess.run(words, capture_output=True, text=True, timeout=120, check=False)
    except subprocess.TimeoutExpired:
        return "does not end"
    if told.returncode < 0:
        return f"the process ends by signal {-told.returncode}"
    return told if told.returncode == 0 else ([*told.stderr.splitlines(), *told.stdout.splitlines()][-1:] or ["no message"])[0]


def _of_program(tool: str, file: Path, stop: float, step: float) -> Values | str:
    """The final values by a program in C, which writes a CSV file; none if it writes no file."""
    rows = Path(tempfile.mkdtemp()) / "rows.csv"
    mode = "me" if file.stem.rpartition("-")[2].startswith("me") else "cs"
    options = {"fmuCheck.linux64": ["-k", mode, "-h", str(step), "-s", str(stop), "-n", "0"],
               "fmi4ctest": ["-m", mode, "-h", str(step), "-s", str(stop)]}[tool]  # fmt: skip
    told = _run([tool, *options, "-o", str(rows), str(file)])
    if isinstance(told, str):
        return told
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
    """The FMUs by model and form."""
    made = {(m, f): folder / f"{m}-{f}.fmu" for m in MODELS for f in FORMS}
    for (model, form), file in made.items():
        if not file.exists():
            export(model, file, **FORMS[form])
    return made


def cells(folder: Path) -> Iterator[tuple[str, str, str]]:
    """(tool, form, cell) for all tools and forms."""
    made = files(folder)
    right = {f: {m: values_in("fmpy", folder, made[m, f]) for m in MODELS} for f in FORMS}
    for tool in [*TOOLS, *(p for p in PROGRAMS if shutil.which(p))]:
        for form in PROGRAMS.get(tool, tuple(FORMS)):
            if (tool == "casadi" and "me" not in form) or (tool == "fmpy_compiled" and "sources" not in FORMS[form]):
                continue
            got = {m: values_in(tool, folder, made[m, form]) for m in MODELS}
            same = right["cs2"] if tool == "fmpy" else right[form]
            worst = [difference(v, same[m]) for m, v in got.items() if not isinstance(v, str) and not isinstance(same[m], str)]
            refused = sorted({v for v in got.values() if isinstance(v, str)})
            ran = f"{len(worst)} of {len(MODELS)}: {max(worst):.1e}" if worst else "refused"
            yield tool, form, "; ".join([ran, *refused])


if __name__ == "__main__":
    for tool, form, cell in cells(Path(sys.argv[1]).resolve()):
        print(f"{tool:18s} {form:9s} {cell}", flush=True)
