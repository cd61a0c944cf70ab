"""Tables of scenes as C text, for models that are exported: the same tapes and constants as in memory (``memory``), beside the
parts that they call."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from typing import Any

from engine.abi.kernels import DIRECTIONS, SCENE
from engine.abi.records import Record
from engine.kernel import compiler
from engine.kernel.emit import MATH, literal
from engine.parts.known import VECTOR, Part
from engine.parts.store import written
from engine.parts.tape import Builtin, Tape
from engine.parts.unit import Derived, Unit

OWN = {Builtin.MEET: "tr_meet", Builtin.GRIP: "tr_grip", Builtin.FACTOR: "tr_factor_loops", Builtin.SOLVE: "tr_solve_loops"}
"""Functions of the machine that are called otherwise than ``tr_m_…``."""
PLACES = "(double*const*,const int*)"
PER_LINE = 30
"""Numbers on a line of C text."""


def parts_texts(units: Iterable[Unit]) -> dict[str, str]:
    """The texts of all functions of parts that some units call, in the order of their names: the same for all scenes of the same
    kinds. "long_parts": of parts that are compiled as long ones (``compiler.part_flags``)."""
    parts: dict[str, Part] = {}
    for of in chain.from_iterable(_scenes(u.scene) for u in units):
        parts |= {name: of.scene.part_of[name] for name in called(of) if name in of.scene.part_of}
    texts = {p.first: p.text or written(*_asked(p)).text for p in parts.values()}
    found = {first: _functions(text) for first, text in texts.items()}
    out = {"parts": "", "long_parts": ""}
    for name, p in sorted(parts.items()):
        out["long_parts" if compiler.part_flags(texts[p.first]) else "parts"] += found[p.first][name]
    return {file: MATH + VECTOR + text for file, text in out.items()}


def _asked(p: Part) -> tuple[Any, ...]:
    module, name, arguments = p.made
    return module, name, *arguments


def _functions(text: str) -> dict[str, str]:
    """The functions of a part by their names, each behind the pieces that it calls."""
    out, pieces = {}, ""
    for piece in re.split(r"(?<=\n}\n)", text.replace(VECTOR, "")):
        pieces += piece
        found = re.search(r"^void (\w+)\(", piece, re.MULTILINE)
        if found:
            out[found.group(1)], pieces = pieces, ""
    return out


def called(of: Derived) -> list[str]:
    """Names of the functions that the tapes of a scene call, in the order of their numbers."""
    numbers = {f for tape in of.scene.tapes.values() for f in _numbers(tape.code, 3)}
    if of.found:
        numbers |= set(_numbers(of.found.tables["code"], 6))
    return [name for name, number in of.scene.functions.items() if number in numbers]


def _numbers(code: Sequence[int], head: int) -> Iterator[int]:
    """Numbers of the functions called; head: integers before the places (of directions also how many blocks are read, written and
    added to, of which two numbers each follow)."""
    at = 0
    while at < len(code):
        yield code[at]
        at += head + 2 * code[at + 1] + code[at + 2] + 2 * sum(code[at + 3 : at + head])


def _scenes(of: Derived) -> list[Derived]:
    return [of, *(_scenes(of.beside) if of.beside else [])]


def unit_text(unit: Unit, name: str) -> str:
    """C text of a table, and of all that it points to."""
    scene, arrays = _scene(unit.scene, "scene"), []
    values: dict[str, Any] = dict.fromkeys(unit.record.names, 0) | unit.numbers
    values |= {field: f"tr_parts_{function}" for field, function in unit.functions.items()}
    for field, numbers in unit.integers.items():
        arrays.append(_integers(f"i_{field}", numbers))
        values[field] = f"i_{field}"
    for field, (record, rows) in unit.records.items():
        arrays.append(_records(f"r_{field}", record, rows))
        values[field] = f"r_{field}"
    machine = "".join(f"extern __typeof__(*(({unit.record.tag}*)0)->{f}) tr_parts_{n};\n" for f, n in unit.functions.items())
    table = unit.record.initialiser(name, **(values | {"scene": "&scene"}))
    return '#include "tr_abi.h"\n' + machine + "".join(scene) + "".join(arrays) + table


def _integers(name: str, values: Sequence[int]) -> str:
    rows = [",".join(str(int(i)) for i in values[k : k + PER_LINE]) for k in range(0, len(values), PER_LINE)]
    text = ",\n".join(rows)
    return f"static const int {name}[]={{{text or 0}}};\n"


def _records(name: str, record: Record, rows: Sequence[tuple[Any, ...]]) -> str:
    text = ",\n".join("{" + ",".join(literal(x) if isinstance(x, float) else str(int(x)) for x in row) + "}" for row in rows)
    return f"static const {record.tag} {name}[]={{{text or '{0}'}}};\n"


def _scene(of: Derived, name: str) -> list[str]:
    """Text of a scene and of what it points to, in their order."""
    s, out = of.scene, []
    used = set(called(of))
    functions = [*(OWN.get(b, f"tr_m_{b.name.lower()}") for b in Builtin), *(f if f in used else "0" for f in s.functions)]
    out += [f"extern void {f}{PLACES};\n" for f in functions if f != "0"]
    out.append(f"static void (*{name}_part[]){PLACES}={{{','.join(functions)}}};\n")
    numbers = ",".join(literal(float(x)) for x in [*s.constants, 0.0])
    out.append(f"static const double {name}_constants[]={{{numbers}}};\n")
    values: dict[str, Any] = dict.fromkeys(SCENE.names, "{0}") | {"nc": s.nc, "directions": 0, "beside": 0}
    for tape, code in s.tapes.items():
        out.append(_integers(f"{name}_{tape}", code.code))
        values[tape] = _tape(f"{name}_{tape}", code)
    if of.found:
        out += [_integers(f"{name}_d_{table}", listed) for table, listed in of.found.tables.items()]
        found = of.found.sizes | {table: f"{name}_d_{table}" for table in of.found.tables}
        out.append("static " + DIRECTIONS.initialiser(f"{name}_directions", **found))
        values["directions"] = f"&{name}_directions"
    if of.beside:
        out += _scene(of.beside, f"{name}_beside")
        values["beside"] = f"&{name}_beside"
    values |= {"constants": f"{name}_constants", "part": f"{name}_part"}
    out.append("static " + SCENE.initialiser(name, **values))
    return out


def _tape(name: str, tape: Tape) -> str:
    return f"{{{len(tape.code)},{tape.scratch},{name}}}"
