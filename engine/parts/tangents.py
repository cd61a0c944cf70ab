"""Tangents of parts: derivatives of a part's function along directions of its inputs, four directions at once.

What depends on the point alone is computed once (``…_at``) and kept; what remains (``…_along``) is linear in the directions, each
number of which is a vector of four. The same is done with the functions of a body that are linear already."""

from __future__ import annotations

import re
from collections.abc import Hashable
from functools import cache
from importlib import import_module

import casadi as ca

from engine.kernel.emit import Input, Output, Stage, emit
from engine.parts.body import body_part
from engine.parts.known import AROUND, KEPT, PIECE, VECTOR, Carried, Part
from engine.parts.one import SIGNATURE, Told
from engine.recursion.vectors import SX

APART = {"sliding", "dN", "four"}
"""Outputs whose derivatives nothing needs."""
FIXED = {"flags", "modes", PIECE}
"""Inputs that change at events alone, or whose changes change nothing to first order."""


@cache
def tangent(module: str, function: str, which: tuple[Hashable, ...], numbers: bool = False) -> Part:
    """Tangents of the part of one function that a function of a module of parts writes from ``which``; along its ``numbers``, too.
    Its sizes: those of all inputs and outputs, of what is kept; one of "out …" for each output, of "added …" for each that is
    added to."""
    told: Told = getattr(import_module(f"engine.parts.{module}"), function)(*which).told
    seeded = [n for n in told.inputs if n not in FIXED and (numbers or n != "numbers")]
    outs = {n: v for n, v in told.outputs.items() if n not in APART}
    seeds = {n: SX.sym(AROUND + n, told.inputs[n].numel()) for n in seeded}
    point = ca.vertcat(SX(0, 1), *[ca.vec(told.inputs[n]) for n in seeded])
    direction = ca.vertcat(SX(0, 1), *seeds.values())
    derived = {n: ca.sparsify(ca.jtimes(v, point, direction)) for n, v in outs.items()}
    derived = {n: ca.densify(v) for n, v in derived.items() if v.nnz()}
    every = [*told.inputs, KEPT, *[AROUND + n for n in [*seeded, *derived]]]
    at = {n: f"a[{i}]" for i, n in enumerate(every)}
    name = told.name + ("_numbers" if numbers else "")
    code = emit(
        [*[Input(at[n], v, 1) for n, v in told.inputs.items()],
         *[Input(f"((tr_vec*){at[AROUND + n]})", v, 2) for n, v in seeds.items()]],
        [Output(f"((tr_vec*){at[AROUND + n]})", 0, v, 2, n in told.added) for n, v in derived.items()],
        [Stage("nothing", SIGNATURE, ""), Stage(f"{name}_at", SIGNATURE, at[KEPT]), Stage(f"{name}_along", SIGNATURE, "")],
    )  # fmt: skip
    sizes = {n: int(v.numel()) for n, v in [*told.inputs.items(), *told.outputs.items()]} | {KEPT: code.kept[1]}
    sizes |= {f"added {n}": 1 for n in told.added} | {f"out {n}": 1 for n in told.outputs}
    return _numbered(name, code.text, every, sizes)


def _numbered(name: str, text: str, every: list[str], sizes: dict[str, int]) -> Part:
    """The two functions with the places that each uses numbered by themselves."""
    pieces = re.split(r"(?<=\n}\n)", text)
    functions: dict[str, list[str]] = {f"{name}_at": [], f"{name}_along": []}
    for piece in pieces:
        found = re.search(r"void (\w+?)(?:_\d+)?\(", piece)
        if found and found.group(1) in functions:
            functions[found.group(1)].append(piece)
    out, places = VECTOR, {}
    for function, bodies in functions.items():
        body = "".join(bodies)
        used = sorted({int(i) for i in re.findall(r"\ba\[(\d+)\]", body)})
        number = {str(i): n for n, i in enumerate(used)}
        body = re.sub(r"\ba\[(\d+)\]", lambda m, number=number: f"a[{number[m.group(1)]}]", body)  # type: ignore[misc]
        out += vectors(body) if function.endswith("_along") else body
        places[function] = tuple(every[i] for i in used)
    return Part(places, sizes, out)


def vectors(text: str) -> str:
    """A function's text with vectors for its own variables, and zeros of theirs."""
    text = re.sub(r"\bdouble (?=v\d|s_)", "tr_vec ", text).replace("double*restrict s_", "tr_vec*restrict s_")
    text = text.replace(":0.0)", ":(tr_vec){0.0})")
    return re.sub(r"^(.*\]\+?=)(0\.0|\(-0\.0\));$", r"\1(tr_vec){0.0};", text, flags=re.MULTILINE)


LINEAR = {"column": ("effort", "fc", "yc", "fq", "up"), "response": ("Z", "yc", "fc", "qdd", "Zo", "N")}
"""Functions of a body that are linear in these places, which are all but what its passes keep."""


@cache
def solving(which: Carried) -> Part:
    """The functions of a body by which accelerations follow from forces, for vectors."""
    part = body_part(which)
    out, places, pieces = VECTOR, {}, ""
    for function in re.split(r"(?<=\n}\n)", part.text):
        pieces += function
        found = re.search(rf"^void {which.name}_(\w+)\(", function, re.MULTILINE)
        if not found:
            continue
        if found.group(1) in LINEAR:
            name = f"{which.name}_{found.group(1)}"
            mine = part.places[name]
            text = pieces
            for i, n in enumerate(mine):
                if n in LINEAR[found.group(1)]:
                    text = re.sub(rf"\ba\[{i}\]\[", f"((tr_vec*)a[{i}])[", text)
            out += vectors(re.sub(rf"\b{name}", f"v{name}", text))
            places[f"v{name}"] = mine
        pieces = ""
    return Part(places, {}, out)
