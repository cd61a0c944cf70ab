"""Export of a scene as a plain C library: C files, header, example, build instructions."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from trunnion.basics.atomic_files import replacing
from trunnion.basics.errors import Problem, SceneError
from trunnion.fmu.c_source.array_size_macros import INPUT, SHELL, sizes_of
from trunnion.fmu.c_source.source_files import texts
from trunnion.fmu.scene_export import ExportedScene, started
from trunnion.fmu.variables.outputs_inputs_parameters import Variable
from trunnion.scene.overrides import Given, scene_given
from trunnion.scene.units.python_arguments import Names
from trunnion.simulation.results.result import Result
from trunnion.simulation.settings.realtime_steps import most_operations, promise

WORDS = (
    "auto break case char const continue default do double else enum extern float for goto if inline int long register restrict "
    "return short signed sizeof static struct switch typedef union unsigned void volatile while main exit abort system memory "
    "model math string stdio stdlib stddef stdarg stdint time web "
    "class new delete template this namespace private public operator try catch bool true false"
)  # fmt: skip
"""Reserved words of C or C++, and names of files of the library. The prefix of a library must not be any of these."""
STATUSES = ("OK", "WARNING", "REFUSED", "ERROR")
EXAMPLE_STEPS = 100


@dataclass(frozen=True)
class Library:
    """A mechanism as a C library. name: prefix of files and functions. files: texts by file name. called: variables by the names of
    their C constants. bytes: size of the struct. step: communication step of the example, s. first: result of a short run from the
    start. operations: bound of a real-time step, None without one. promise: ``operations`` in words
    (``simulation.settings.realtime_steps``)."""

    name: str
    files: dict[str, str]
    called: dict[str, Variable]
    bytes: int
    step: float
    first: Result
    operations: int | None = None
    promise: str = ""


def library(
    scene: Given,
    overrides: Mapping[str, Any] | None = None,
    outputs: Names | None = None,
    step: float = 0.0,
    checked: bool = False,
) -> Library:
    """Export a scene as a C library. overrides, outputs: as in ``trunnion.simulate``. step: default of solver.step, s (0: error
    control). checked: whether array lengths are checked at run time (``constant_length_arrays.fixed``). Raises SceneError for wrong
    input, and SimulationError when the scene cannot start."""
    model, first = started(scene_given(scene, overrides), outputs, "compiled")
    made = ExportedScene(model, first, step)
    name = library_name(made.identifier)
    sizes = sizes_of(made.sources, made.model)
    called = names_in_c(name, made.listed)
    room = SHELL // 8 + 2 * (len(made.listed) + len(made.all.followers)) + INPUT // 8 * sizes.linear.get("ninputs", 0) + 16
    total = sizes.block // 8 + room + sizes.outputs["nout"]
    files = texts(made.sources, sizes, "library", name, checked)
    given = _given(name, called, total, made) | {"sources": " ".join(sorted(files))}
    files |= {file: filled(file, given) for file in ("main.c", "CMakeLists.txt", "README.md")}
    files[f"{name}.h"] = filled("mechanism.h", given)
    steps = model.built.scene, model.kernel
    return Library(name, files, called, total * 8, made.step, first, most_operations(*steps), promise(*steps))


def write_files(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write files into a folder, each atomically. Raises SceneError on failure."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in files.items():
            with replacing(folder / name) as work:
                work.write_bytes(content)
    except OSError as e:
        raise SceneError(
            [Problem("-o", f"cannot write into {str(folder)!r}: {e.strerror or e}", "give the name of a folder")]
        ) from e


def library_name(identifier: str) -> str:
    """The prefix of files and functions for a model identifier."""
    name = identifier.lower()
    return f"m_{name}" if name in WORDS.split() else name


def names_in_c(name: str, listed: Sequence[Variable]) -> dict[str, Variable]:
    """The variables by the names of their C constants, in the order of the constants' values."""
    out: dict[str, Variable] = {}
    taken = set(STATUSES)
    for v in listed:
        plain = re.sub(r"\W+", "_", v.name, flags=re.ASCII).strip("_")
        word = next(w for w in _numbered(plain) if w not in taken)
        taken.add(word)
        out[f"{name.upper()}_{word}"] = v
    return out


def _numbered(word: str) -> Iterator[str]:
    yield word
    i = 1
    while i := i + 1:
        yield f"{word}_{i}"


def filled(template: str, given: Mapping[str, str]) -> str:
    """The text of a template in which each ``@word@`` is replaced by ``given[word]``."""
    return re.sub(r"@(\w+)@", lambda found: given[found[1]], (Path(__file__).parent / "templates" / f"{template}.txt").read_text())


def plain(text: str) -> str:
    """The text in ASCII, without sequences that would end a C comment or string."""
    return text.encode("ascii", "replace").decode().replace("*/", "* /").replace('"', "'").replace("\\", "/")


def _row(constant: str, v: Variable, first: bool) -> str:
    kind = "output" if v.causality == "local" else v.causality
    return f"  {constant}{' = 0' if first else ''}, /* {kind}, {v.unit or '1'}: {plain(v.name)} */"


def _given(name: str, called: Mapping[str, Variable], doubles: int, made: ExportedScene) -> dict[str, str]:
    """The replacements in the templates for a mechanism, by word."""
    shown = next((c for c, v in called.items() if v.name.endswith(".q[1]")), next(iter(called)))
    return {
        "name": name, "NAME": name.upper(), "scene": plain(made.scene.name), "doubles": str(doubles), "bytes": str(8 * doubles),
        "statuses": ", ".join(f"{name.upper()}_{s}" for s in STATUSES), "shell": str(SHELL), "input": str(INPUT),
        "rows": "\n".join(_row(c, v, i == 0) for i, (c, v) in enumerate(called.items())), "count": str(len(called)),
        "inputs": str(sum(v.causality == "input" for v in called.values())),
        "parameters": str(sum(v.causality == "parameter" for v in called.values())),
        "steps": str(EXAMPLE_STEPS), "step": repr(made.step), "shown": shown,
        "plain": plain(called[shown].name).replace("%", "%%"),
    }  # fmt: skip
