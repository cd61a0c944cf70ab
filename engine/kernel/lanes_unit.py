"""The lanes of a kernel: its generated C once more, compiled as C++ with a vector of doubles for each double, so that it does for
several cases what it does for one (``lanes/vectors.hpp``); around it what cases ask of it (``lanes/steps.hpp``)."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from engine.abi.kernels import KERNEL, OUTPUTS
from engine.abi.runs import EXTRA
from engine.integrators import REGISTRY, Tableau
from engine.integrators.header import explicit_text

if TYPE_CHECKING:
    from engine.kernel.library import Kernel

WIDTH = 4
"""Cases at once. Eight (AVX-512) do no more for each: divisions, square roots and the sides of caches take as long."""
FOLDER = Path(__file__).with_name("lanes")
HEADERS = ("vectors.hpp", "loops.hpp", "friction.hpp", "steps.hpp", "rows.hpp", "serve.hpp")
FLAGS = ("-std=gnu++17", "-fno-exceptions", "-fno-rtti", "-fno-slp-vectorize")
"""Flags beyond those of C units; built to run fast whatever the environment says, as lanes are for nothing else."""
NUMBERS = "#define NAN __builtin_nan(\"\")\n#define INFINITY __builtin_inf()\n"
COLUMNS_TABLES = "static const tr_post o_post"
TABLES = "static const tr_pace k_pace"
MOST_FRICTIONS = 12
"""Multipliers of friction up to which lanes solve for them: of more the maps are large, and the recursion does without them."""
MOST_TEXT, MOST_MAPS = 60_000, 1_000
"""Characters of the unit of columns, and numbers of the maps, up to which rows are made several at once: compiling takes as long
again, and rows are made on the stacks of cases."""
CHOICE = "!=0)?"
OTHERWISE = ":0.0"


def stands_for(kernel: Kernel) -> bool:
    """Whether lanes do for a kernel: it is compiled in straight lines, little rubs, nothing follows tables, its loops are few."""
    table = KERNEL.ctype.from_address(kernel.address("kernel"))
    made = (kernel.folder / "kernel.c").exists() and table.neta <= MOST_FRICTIONS
    return made and not any(getattr(table, n) for n in ("ntables", "nfill", "nkappa", "begin", "shift"))


def sizes_of_columns(kernel: Kernel) -> dict[str, int] | None:
    """What the columns of rows are made from; None where they are made one row after the other."""
    table = OUTPUTS.ctype.from_address(kernel.address("outputs"))
    text = kernel.folder / "outputs.c"
    if not table.nout or kernel.sizes["nmaps"] > MOST_MAPS or not text.exists() or text.stat().st_size > MOST_TEXT:
        return None
    return {"nco": table.nc, "nout": table.nout, "nextra": EXTRA.numbers + kernel.sizes["nsliders"]}


def lanes_text(kernel: str, sizes: Mapping[str, int]) -> str:
    """C++ text of the lanes of a kernel, from the C text of its stepping unit and its sizes."""
    vectors, *others = ((FOLDER / name).read_text(encoding="utf-8") for name in HEADERS)
    methods = [m for m in REGISTRY if isinstance(m, Tableau)]
    numbers = {n: 1 + REGISTRY.index(m) for n, m in enumerate(methods)}
    choose = "".join(f"(number)=={numbers[n]}?&{m.name}_method:" for n, m in enumerate(methods)) + "0"
    head = f'#define METHOD(number) ({choose})\n#include "tr_abi.h"\n' + _sizes(sizes, max(m.rows for m in methods))
    head += NUMBERS
    tables = "".join(map(_method, methods))
    return head + vectors + generated(kernel, TABLES) + "".join(others).replace("METHODS\n", tables, 1)


def columns_text(outputs: str, sizes: Mapping[str, int]) -> str:
    """C++ text of the columns of several rows at once, from the C text of the unit of columns and its sizes."""
    named = "".join(f", {n} = {sizes[n.lower()]}" for n in ("NCO", "NEXTRA", "NOUT"))
    head = f'#define WIDTH {WIDTH}\n#include "tr_abi.h"\n{NUMBERS}enum {{COLUMNS{named}}};\n'
    made = generated(outputs, COLUMNS_TABLES)
    return head + (FOLDER / HEADERS[0]).read_text(encoding="utf-8") + made + (FOLDER / "columns.hpp").read_text(encoding="utf-8")


def _sizes(sizes: Mapping[str, int], stages: int) -> str:
    """What the headers know of a kernel: sizes, and where in its maps what is."""
    a, e, wide = sizes["active"], sizes["neta"], sizes["nq"] + sizes["nv"] + sizes["nb"] + sizes["npowers"] + 2
    loads = a * a + a * e + a
    own = ("nq", "nv", "nx", "nc", "nw", "nmaps", "npowers", "ntaken", "rows", "nn", "ndn", "nsliders", "nelements", "nstops")
    named = {n.upper(): sizes[n] for n in own} | {
        "NY": sizes["nq"] + sizes["nv"] + sizes["nb"], "QUATERNIONS": sizes["nquat"], "C_CLOSURE": sizes["c_closure"],
        "C_LAWS": sizes["c_laws"], "MOST_WIDE": -(-wide // WIDTH) * WIDTH + WIDTH, "STAGES": stages, "MAP_N0": loads,
        "MAP_NE": loads + sizes["nn"] * (1 + a), "MAP_RATES": loads + sizes["nn"] * (1 + a + e),
    }  # fmt: skip
    said = "enum {" + ", ".join(f"{k} = {v}" for k, v in named.items()) + "};\n"
    return f"#define WIDTH {WIDTH}\n#define ACTIVE {a}\n#define NETA {e}\n" + said


def _method(m: Tableau) -> str:
    """The coefficients of an explicit method, for states of which each number is a vector."""
    text = re.sub(r"\btr_(combination|explicit)\b", r"lane_\1", explicit_text(m))
    text = text.replace("TR_NOUGHT", "0.0").replace("restrict", "__restrict")
    return re.sub(r"\bdouble h\b", "V h", re.sub(r"\btr_vec\b", "V", text))


def generated(unit: str, tables: str) -> str:
    """The functions of a unit's C text, and its tables of integers in front of ``tables``, with V for double."""
    begin = unit.index('#include "tr_abi.h"\n') + len('#include "tr_abi.h"\n')
    text = inverted(chosen(unit[begin : unit.index(tables)]))
    text = re.sub(r"^(?:__attribute__\(\(noinline\)\) )?(?:static )?void ", "static void ", text, flags=re.MULTILINE)
    return re.sub(r"\bdouble\b", "V", text).replace("restrict", "__restrict")


def inverted(text: str) -> str:
    """The text with one division and products for what is divided several times by the same value: the divider takes as long for
    four doubles as for four by themselves."""
    return "\n}\n".join(map(_inverted, text.split("\n}\n")))


def _inverted(body: str) -> str:
    """The same of one function."""
    often = {v for v, n in Counter(re.findall(r"/(v\d+)\b", body)).items() if n > 1 and f"double {v}=" in body}
    body = re.sub(r"/(v\d+)\b", lambda m: f"*i{m[1]}" if m[1] in often else m[0], body)
    return re.sub(r"^double (v\d+)=.*;$", lambda m: m[0] + f"\ndouble i{m[1]}=1.0/{m[1]};" * (m[1] in often), body, flags=re.M)


def chosen(text: str) -> str:
    """The text with ``where(a, b)`` for each ``(a!=0)?b:0.0``: a vector cannot be asked whether it is zero."""
    while (at := text.find(CHOICE)) >= 0:
        start, depth = at, 1
        while depth:
            start -= 1
            depth += (text[start] == ")") - (text[start] == "(")
        end, depth = at + len(CHOICE), 0
        while depth or text[end] != ":":
            depth += (text[end] == "(") - (text[end] == ")")
            end += 1
        assert text.startswith(OTHERWISE, end), text[end : end + 20]
        text = f"{text[:start]}where({text[start + 1 : at]},{text[at + len(CHOICE) : end]}){text[end + len(OTHERWISE) :]}"
    return text

