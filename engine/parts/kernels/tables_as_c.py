"""Tables of a bytecode kernel as C text for exported models, with the primitives that its programs call."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from typing import Any

from trunnion.kernel.c_code.code_generator import MATH, literal
from trunnion.kernel.compilation import c_compiler
from trunnion.parts.bytecode.program import Builtin
from trunnion.parts.kernels.table_contents import DifferentiatedScene, UnitDescription
from trunnion.parts.primitives.primitive_cache import build_primitive
from trunnion.parts.primitives.primitive_keys import VECTOR, Primitive
from trunnion.runtime.abi.kernel_records import DIRECTIONS, SCENE
from trunnion.runtime.abi.record_definition import Record

OPERANDS = "(double*const*,const int*)"
PER_LINE = 30
"""Number of integers on a line of C text."""


def parts_texts(units: Iterable[UnitDescription]) -> dict[str, str]:
    """C text of all primitives that the units call, sorted by name. The entry "long_parts" contains the primitives that need other
    compiler flags (``c_compiler.part_flags``), "parts" all others. Scenes of the same kind have equal texts."""
    primitives: dict[str, Primitive] = {}
    for of in chain.from_iterable(_scenes(u.scene) for u in units):
        primitives |= {name: of.scene.primitive_of[name] for name in called(of) if name in of.scene.primitive_of}
    texts = {p.first: p.text or build_primitive(*p.recipe).text for p in primitives.values()}
    found = {first: _functions(text) for first, text in texts.items()}
    out = {"parts": "", "long_parts": ""}
    for name, p in sorted(primitives.items()):
        out["long_parts" if c_compiler.part_flags(texts[p.first]) else "parts"] += found[p.first][name]
    return {file: MATH + VECTOR + text for file, text in out.items()}


def _functions(text: str) -> dict[str, str]:
    """The functions of a primitive by name. The text of a function includes the helper functions that it calls."""
    out, pieces = {}, ""
    for piece in re.split(r"(?<=\n}\n)", text.replace(VECTOR, "")):
        pieces += piece
        found = re.search(r"^void (\w+)\(", piece, re.MULTILINE)
        if found:
            out[found.group(1)], pieces = pieces, ""
    return out


def called(of: DifferentiatedScene) -> list[str]:
    """Names of the ops that the programs of a scene call, ordered by op number."""
    numbers = {f for program in of.scene.programs.values() for f in _numbers(program.code, 3)}
    if of.tangents:
        numbers |= set(_numbers(of.tangents.tables["code"], 6))
    return [name for name, number in of.scene.functions.items() if number in numbers]


def _numbers(code: Sequence[int], head: int) -> Iterator[int]:
    """Numbers of the ops that a program calls. head: number of integers at the start of a call. In a program of tangents, three
    more integers follow this head: the numbers of inputs, outputs and added outputs. Two integers for each input, output and added
    output come last."""
    at = 0
    while at < len(code):
        yield code[at]
        at += head + 2 * code[at + 1] + code[at + 2] + 2 * sum(code[at + 3 : at + head])


def _scenes(of: DifferentiatedScene) -> list[DifferentiatedScene]:
    return [of, *(_scenes(of.beside) if of.beside else [])]


def unit_text(unit: UnitDescription, name: str) -> str:
    """C text of a table, and of all arrays to which the table points."""
    scene, arrays = _scene(unit.scene, "scene"), []
    values: dict[str, Any] = dict.fromkeys(unit.record.names, 0) | unit.numbers
    values |= {field: f"tr_parts_{function}" for field, function in unit.functions.items()}
    for field, numbers in unit.integers.items():
        arrays.append(_integers(f"i_{field}", numbers))
        values[field] = f"i_{field}"
    for field, (record, rows) in unit.records.items():
        arrays.append(_records(f"r_{field}", record, rows))
        values[field] = f"r_{field}"
    interpreter = "".join(f"extern __typeof__(*(({unit.record.tag}*)0)->{f}) tr_parts_{n};\n" for f, n in unit.functions.items())
    table = unit.record.initialiser(name, **(values | {"scene": "&scene"}))
    return '#include "tr_abi.h"\n' + interpreter + "".join(scene) + "".join(arrays) + table


def _integers(name: str, values: Sequence[int]) -> str:
    rows = [",".join(str(int(i)) for i in values[k : k + PER_LINE]) for k in range(0, len(values), PER_LINE)]
    text = ",\n".join(rows)
    return f"static const int {name}[]={{{text or 0}}};\n"


def _records(name: str, record: Record, rows: Sequence[tuple[Any, ...]]) -> str:
    text = ",\n".join("{" + ",".join(literal(x) if isinstance(x, float) else str(int(x)) for x in row) + "}" for row in rows)
    return f"static const {record.tag} {name}[]={{{text or '{0}'}}};\n"


def _scene(of: DifferentiatedScene, name: str) -> list[str]:
    """C text of a scene, after the text of the arrays to which the scene points."""
    s, out = of.scene, []
    used = set(called(of))
    functions = [*(f"tr_op_{b.name.lower()}" for b in Builtin), *(f if f in used else "0" for f in s.functions)]
    out += [f"extern void {f}{OPERANDS};\n" for f in functions if f != "0"]
    out.append(f"static void (*{name}_op[]){OPERANDS}={{{','.join(functions)}}};\n")
    numbers = ",".join(literal(float(x)) for x in [*s.constants, 0.0])
    out.append(f"static const double {name}_constants[]={{{numbers}}};\n")
    values: dict[str, Any] = dict.fromkeys(SCENE.names, "{0}") | {"nc": s.nc, "directions": 0, "beside": 0}
    for program, code in s.programs.items():
        calls = code.merged()
        out.append(_integers(f"{name}_{program}", calls))
        values[program] = f"{{{len(calls)},{code.scratch},{name}_{program}}}"
    if of.tangents:
        out += [_integers(f"{name}_d_{table}", listed) for table, listed in of.tangents.tables.items()]
        found = of.tangents.sizes | {table: f"{name}_d_{table}" for table in of.tangents.tables}
        out.append("static " + DIRECTIONS.initialiser(f"{name}_directions", **found))
        values["directions"] = f"&{name}_directions"
    if of.beside:
        out += _scene(of.beside, f"{name}_beside")
        values["beside"] = f"&{name}_beside"
    values |= {"constants": f"{name}_constants", "op": f"{name}_op"}
    out.append("static " + SCENE.initialiser(name, **values))
    return out
