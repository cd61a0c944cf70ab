"""C text of the functions that hosts call. Each sets the floating-point environment, calls the model's function with the prefix
``INSIDE``, and restores the host's environment. These functions are a translation unit of their own, so that no compiler moves
arithmetic across the change of the environment."""

from __future__ import annotations

import re
from pathlib import Path

INSIDE = "fmu_"
"""Prefix of the model's functions in ``native/standards``."""
HEADERS = {"2.0": "fmi2Functions.h", "3.0": "fmi3Functions.h", "library": "mechanism.h"}
DECLARED = {"2.0": "fmi2FunctionTypes.h", "3.0": "fmi3FunctionTypes.h", "library": "mechanism.h.txt"}
"""By kind of export: the header with the functions, and the file that lists their types."""
NAME = r"((?:fmi[23]|mechanism_)\w+?)(?:TYPE)?"
FUNCTION = re.compile(rf"^(?: *typedef )? *((?:const )?\w+(?: \*|\*| )) *{NAME} *\(([^;()]*)\);", re.MULTILINE)
WORD = re.compile(r"[A-Za-z_]\w*")


def entry_points(kind: str, folder: Path) -> str:
    """The C text for a kind of export (a key of HEADERS). folder: the folder with the file in DECLARED."""
    text = (folder / DECLARED[kind]).read_text().replace("@name@", "mechanism")
    made = [_function(*found) for found in FUNCTION.findall(text)]
    return "\n".join([f'#include "{HEADERS[kind]}"\n#include "floating_point_environment.h"\n', *made])


def _function(result: str, name: str, parameters: str) -> str:
    """One function, with the prototype of the model's function that it calls."""
    taken = [] if parameters.strip() == "void" else [_named(p, i) for i, p in enumerate(parameters.split(","))]
    declared, call = ", ".join(taken) or "void", f"{INSIDE}{name}({', '.join(WORD.findall(p)[-1] for p in taken)});"
    has_result = result.strip() != "void"
    kind = "const char *" if "*" in result else result
    body = [
        "const fmu_environment host = fmu_enter();",
        f"{kind}result = {call}" if has_result else call,
        "fmu_leave(host);",
        *["return result;"] * has_result,
    ]
    lines = "".join(f"  {line}\n" for line in body)
    return f"{kind}{INSIDE}{name}({declared});\n{kind}{name}({declared}) {{\n{lines}}}\n"


def _named(parameter: str, index: int) -> str:
    """A parameter with a name; the headers of FMI 2.0 omit one."""
    plain = " ".join(parameter.split())
    return plain if len(WORD.findall(plain.replace("const ", ""))) > 1 else re.sub(r"^\w+", rf"\g<0> x{index}", plain)
