"""C++ text with which a kernel steps several cases in SIMD lanes. The text is the generated C with a vector for each double
(``simd_lanes/vector_type.hpp``). The functions in ``simd_lanes/explicit_steps.hpp`` serve the requests of cases."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

from trunnion.runtime.abi.header_constants import used_by
from trunnion.runtime.integrators import REGISTRY, Tableau
from trunnion.runtime.integrators.method_c_code import explicit_text

WIDTH = 4
"""Number of lanes. Eight lanes (AVX-512) are not faster per lane, because divisions, square roots and caches then take twice as
long."""
FOLDER = Path(__file__).parents[1] / "simd_lanes"
HEADERS = ("vector_type", "loop_solve", "friction_newton", "explicit_steps", "dense_output_rows", "request_dispatch")
FLAGS = ("-std=gnu++17", "-fno-exceptions", "-fno-rtti", "-fno-slp-vectorize")
"""Additional compiler flags. The text is always compiled with optimisation, because speed is its only purpose."""
NUMBERS = "#define NAN __builtin_nan(\"\")\n#define INFINITY __builtin_inf()\n"
COLUMNS_TABLES = "static const tr_post o_post"
TABLES = "static const tr_pace k_pace"
CHOICE = "!=0)?"
OTHERWISE = ":0.0"


def lanes_text(kernel: str, sizes: Mapping[str, int]) -> str:
    """C++ text of the lanes of a kernel. kernel: C text of its stepping unit; sizes: the kernel's sizes by name."""
    vectors, *others = map(_header, HEADERS)
    methods = [m for m in REGISTRY if isinstance(m, Tableau)]
    numbers = {n: 1 + REGISTRY.index(m) for n, m in enumerate(methods)}
    choose = "".join(f"(number)=={numbers[n]}?&{m.name}_method:" for n, m in enumerate(methods)) + "0"
    head = f'#define METHOD(number) ({choose})\n#include "tr_abi.h"\n' + _sizes(sizes, max(m.rows for m in methods))
    tables, lanes = "".join(map(_method, methods)), "".join(others)
    shared = used_by(lanes).replace("double", "V")
    return head + NUMBERS + vectors + shared + generated(kernel, TABLES) + lanes.replace("METHODS\n", tables, 1)


def columns_text(outputs: str, sizes: Mapping[str, int]) -> str:
    """C++ text that computes the columns of several rows at once. The text is made from the C text of the output unit and its
    sizes."""
    named = "".join(f", {n} = {sizes[n.lower()]}" for n in ("NCO", "NEXTRA", "NOUT"))
    head = f'#define WIDTH {WIDTH}\n#include "tr_abi.h"\n{NUMBERS}enum {{COLUMNS{named}}};\n'
    return head + _header(HEADERS[0]) + generated(outputs, COLUMNS_TABLES) + _header("output_columns")


def _header(name: str) -> str:
    return (FOLDER / f"{name}.hpp").read_text(encoding="utf-8")


def _sizes(sizes: Mapping[str, int], stages: int) -> str:
    """Constants for the headers: sizes of a kernel, and offsets in its maps."""
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
    """C++ text of an explicit method, for states whose components are vectors."""
    text = re.sub(r"\btr_(combination|explicit)\b", r"lane_\1", explicit_text(m))
    text = text.replace("TR_NOUGHT", "0.0").replace("restrict", "__restrict")
    return re.sub(r"\bdouble h\b", "V h", re.sub(r"\btr_vec\b", "V", text))


def generated(unit: str, tables: str) -> str:
    """The C text of a unit up to ``tables``, with V in place of double. This part contains functions and tables of integers."""
    begin = unit.index('#include "tr_abi.h"\n') + len('#include "tr_abi.h"\n')
    text = inverted(chosen(unit[begin : unit.index(tables)]))
    text = re.sub(r"^(?:__attribute__\(\(noinline\)\) )?(?:static )?void ", "static void ", text, flags=re.MULTILINE)
    return re.sub(r"\bdouble\b", "V", text).replace("restrict", "__restrict")


def inverted(text: str) -> str:
    """The text with one reciprocal in place of several divisions by the same value. A vector division takes as long as four scalar
    divisions."""
    return "\n}\n".join(map(_inverted, text.split("\n}\n")))


def _inverted(body: str) -> str:
    """The result of ``inverted`` for one function."""
    often = {v for v, n in Counter(re.findall(r"/(v\d+)\b", body)).items() if n > 1 and f"double {v}=" in body}
    body = re.sub(r"/(v\d+)\b", lambda m: f"*i{m[1]}" if m[1] in often else m[0], body)
    return re.sub(r"^double (v\d+)=.*;$", lambda m: m[0] + f"\ndouble i{m[1]}=1.0/{m[1]};" * (m[1] in often), body, flags=re.M)


def chosen(text: str) -> str:
    """The text with ``where(a, b)`` in place of each ``(a!=0)?b:0.0``, because C++ does not accept a vector as a condition."""
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

