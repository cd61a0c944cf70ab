"""C text of the functions that hosts call: in FMUs, in C libraries, and from Python. Each of these functions sets the
floating-point environment, calls the function that does the work, and restores the host's environment. They form a separate
translation unit, so that no compiler moves arithmetic across the change of the environment."""

from __future__ import annotations

import re

NAME = r"((?:fmi[23]|mechanism_|tr_)\w+?)(?:TYPE)?"
FUNCTION = re.compile(rf"^(?: *typedef )? *((?:const )?\w+(?: \*|\*| )) *{NAME} *\(([^;()]*)\);", re.MULTILINE)
WORD = re.compile(r"[A-Za-z_]\w*")


def entry_points(header: str, declared: str, host: str = "", inside: str = "") -> str:
    """C text of the entry points. header: name of the header with the types and functions. declared: text with the prototypes or
    types of the functions. host: prefix of the functions that hosts call. inside: prefix of the functions that do the work."""
    made = [_function(result, name, taken, host, inside) for result, name, taken in FUNCTION.findall(declared)]
    return "\n".join([f'#include "{header}"\n#include "base/floating_point_environment.h"\n', *made])


def _function(result: str, name: str, parameters: str, host: str, inside: str) -> str:
    """One function, with the prototype of the function that it calls."""
    taken = [] if parameters.strip() == "void" else [_named(p, i) for i, p in enumerate(parameters.split(","))]
    declared, call = ", ".join(taken) or "void", f"{inside}{name}({', '.join(WORD.findall(p)[-1] for p in taken)});"
    has_result = result.strip() != "void"
    body = [
        "const tr_environment outside = tr_enter();",
        f"{result}result = {call}" if has_result else call,
        "tr_leave(outside);",
        *["return result;"] * has_result,
    ]
    lines = "".join(f"  {line}\n" for line in body)
    return f"{result}{inside}{name}({declared});\n{result}{host}{name}({declared}) {{\n{lines}}}\n"


def _named(parameter: str, index: int) -> str:
    """A parameter with a name. The headers of FMI 2.0 omit the name of one parameter."""
    plain = " ".join(parameter.split())
    return plain if len(WORD.findall(plain.replace("const ", ""))) > 1 else re.sub(r"^\w+", rf"\g<0> x{index}", plain)
