"""Tangents of primitives: derivatives along four directions of their inputs at once.

Op ``…_at`` computes values that depend only on the point. Op ``…_along`` is linear in the directions; each of its numbers is a
vector of four. Body functions that are linear need no derivative: they become vector functions."""

from __future__ import annotations

import re
from collections.abc import Hashable
from functools import cache
from importlib import import_module

import casadi as ca

from trunnion.kernel.c_code.code_generator import Input, Output, Stage, emit
from trunnion.parts.primitives.body_step import body_primitive
from trunnion.parts.primitives.primitive_from_expressions import SIGNATURE, Expressions
from trunnion.parts.primitives.primitive_keys import AROUND, KEPT, PIECE, VECTOR, BodyKey, Primitive
from trunnion.recursion.vector_algebra import SX

APART = {"sliding", "dN", "out_watched"}
"""Outputs without derivatives."""
FIXED = {"flags", "modes", PIECE}
"""Inputs that change only at events, or whose changes have no first-order effect."""


@cache
def tangent(module: str, function: str, which: tuple[Hashable, ...], numbers: bool = False) -> Primitive:
    """Tangents of the primitive with one op that a function of a module builds from ``which``. numbers: whether directions also
    change the operand ``numbers``.

    sizes of the result: sizes of all inputs, outputs and stored values. The keys of outputs are "out NAME", or "added NAME" for an
    output that is added to its slot."""
    expressions: Expressions = getattr(import_module(f"trunnion.parts.primitives.{module}"), function)(*which).expressions
    seeded = [n for n in expressions.inputs if n not in FIXED and (numbers or n != "numbers")]
    outs = {n: v for n, v in expressions.outputs.items() if n not in APART}
    seeds = {n: SX.sym(AROUND + n, expressions.inputs[n].numel()) for n in seeded}
    point = ca.vertcat(SX(0, 1), *[ca.vec(expressions.inputs[n]) for n in seeded])
    direction = ca.vertcat(SX(0, 1), *seeds.values())
    derived = {n: ca.sparsify(ca.jtimes(v, point, direction)) for n, v in outs.items()}
    derived = {n: ca.densify(v) for n, v in derived.items() if v.nnz()}
    every = [*expressions.inputs, KEPT, *[AROUND + n for n in [*seeded, *derived]]]
    at = {n: f"a[{i}]" for i, n in enumerate(every)}
    name = expressions.name + ("_numbers" if numbers else "")
    code = emit(
        [*[Input(at[n], v, 1) for n, v in expressions.inputs.items()],
         *[Input(f"((tr_vec*){at[AROUND + n]})", v, 2) for n, v in seeds.items()]],
        [Output(f"((tr_vec*){at[AROUND + n]})", 0, v, 2, n in expressions.added) for n, v in derived.items()],
        [Stage("nothing", SIGNATURE, ""), Stage(f"{name}_at", SIGNATURE, at[KEPT]), Stage(f"{name}_along", SIGNATURE, "")],
    )  # fmt: skip
    sizes = {n: int(v.numel()) for n, v in [*expressions.inputs.items(), *expressions.outputs.items()]} | {KEPT: code.kept[1]}
    sizes |= {f"added {n}": 1 for n in expressions.added} | {f"out {n}": 1 for n in expressions.outputs}
    return _numbered(name, code.text, every, sizes)


def _numbered(name: str, text: str, every: list[str], sizes: dict[str, int]) -> Primitive:
    """A primitive of the two ops, each with its operands renumbered."""
    pieces = re.split(r"(?<=\n}\n)", text)
    functions: dict[str, list[str]] = {f"{name}_at": [], f"{name}_along": []}
    for piece in pieces:
        found = re.search(r"void (\w+?)(?:_\d+)?\(", piece)
        if found and found.group(1) in functions:
            functions[found.group(1)].append(piece)
    out, operands = VECTOR, {}
    for function, bodies in functions.items():
        body = "".join(bodies)
        used = sorted({int(i) for i in re.findall(r"\ba\[(\d+)\]", body)})
        number = {str(i): n for n, i in enumerate(used)}
        body = re.sub(r"\ba\[(\d+)\]", lambda m, number=number: f"a[{number[m.group(1)]}]", body)  # type: ignore[misc]
        out += vectors(body) if function.endswith("_along") else body
        operands[function] = tuple(every[i] for i in used)
    return Primitive(operands, sizes, out)


def vectors(text: str) -> str:
    """The text of an op, with vectors instead of doubles for variables and zeros."""
    text = re.sub(r"\bdouble (?=v\d|s_)", "tr_vec ", text).replace("double*restrict s_", "tr_vec*restrict s_")
    text = text.replace(":0.0)", ":(tr_vec){0.0})")
    return re.sub(r"^(.*\]\+?=)(0\.0|\(-0\.0\));$", r"\1(tr_vec){0.0};", text, flags=re.MULTILINE)


LINEAR = {"column": ("effort", "fc", "yc", "fq", "up"), "response": ("Z", "yc", "fc", "qdd", "Zo", "N")}
"""Operands in which a body's function is linear: all operands except stored values."""


@cache
def solving(which: BodyKey) -> Primitive:
    """Vector versions of the body functions that compute accelerations from forces."""
    primitive = body_primitive(which)
    out, operands, pieces = VECTOR, {}, ""
    for function in re.split(r"(?<=\n}\n)", primitive.text):
        pieces += function
        found = re.search(rf"^void {which.name}_(\w+)\(", function, re.MULTILINE)
        if not found:
            continue
        if found.group(1) in LINEAR:
            name = f"{which.name}_{found.group(1)}"
            mine = primitive.operands[name]
            text = pieces
            for i, n in enumerate(mine):
                if n in LINEAR[found.group(1)]:
                    text = re.sub(rf"\ba\[{i}\]\[", f"((tr_vec*)a[{i}])[", text)
            out += vectors(re.sub(rf"\b{name}", f"v{name}", text))
            operands[f"v{name}"] = mine
        pieces = ""
    return Primitive(operands, {}, out)
