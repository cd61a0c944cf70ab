"""The C texts of an exported model, each a file that includes nothing of ours but ``NAME.h``."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache

from engine.abi.header import header
from engine.integrators.header import header as tables
from engine.kernel.emit import MATH
from engine.kernel.library import RUNTIME
from fmu.platforms import NATIVE
from fmu.sources.one_file import in_folders, one_file
from fmu.sources.scratch import fixed
from fmu.sources.sizes import Sizes
from fmu.sources.tidy import ascii_only, definitions, nothing_unused, renamed, used_only

SHELLS = {"2.0": "fmi2.c", "3.0": "fmi3.c", "library": "library.c"}
"""The shell of each kind of export: the functions of a standard, or those of a C library."""
LEFT = ("fmi2Functions.h", "fmi3Functions.h")
"""What compilers of an FMU's sources bring (FMI 2.0, 2.3; 3.0, 2.5.1.2), and what is written for each model."""
UNUSED = ("batch.c", "ensemble.c", "hold.c", "worn.c")
"""Files of the runtime that no host of an exported model calls."""
EXPORT = re.compile(r"^#if defined _WIN32\n#define FMU_EXPORT .*?^#endif\n", re.MULTILINE | re.DOTALL)
TABLE = re.compile(r"^const \w+ (\w+)=", re.MULTILINE)


def texts(units: Mapping[str, str], sizes: Sizes, kind: str, prefix: str, checked: bool = False) -> dict[str, str]:
    """C files by name. units: generated texts (``Made.sources``); kind: one of SHELLS; prefix: begins the names that other files
    see; checked: arrays of the runtime are held against the lengths they are asked for (``scratch.fixed``)."""
    alone = kind == "library"
    shell = finished((NATIVE / SHELLS[kind]).read_text(), alone)
    made = {"runtime": finished('#include "api.c"\n', alone, checked), "shell": shell} | {
        n: _unit(text) for n, text in units.items()
    }
    names = {n: f"{prefix}_{n}" for n in _seen(made)}
    if alone:
        names |= {n: re.sub("mechanism", prefix, n) for n in set(re.findall(r"\bmechanism\w*", shell))}
        names |= {n: re.sub("MECHANISM", prefix.upper(), n) for n in set(re.findall(r"\bMECHANISM_\w+", shell))}
    head = sizes.text() + (NATIVE / "portable.h").read_text()
    out = {f"{prefix}_{name}.c": renamed(_begin(name, kind, prefix) + head + text, names) for name, text in made.items()}
    return dict(sorted(out.items()))


def _begin(name: str, kind: str, prefix: str) -> str:
    """What the file of the shell begins with: FMI's functions are named after the model where the compiler's headers want that."""
    if name != "shell":
        return ""
    return f'#include "{prefix}.h"\n' if kind == "library" else f"#define FMI{kind[0]}_FUNCTION_PREFIX {prefix}_\n"


def _unit(text: str) -> str:
    """A generated file."""
    return finished(text.replace(MATH, "#include <math.h>\n").replace("__attribute__((noinline)) ", ""), False)


@lru_cache(maxsize=8)
def finished(start: str, alone: bool, checked: bool = False) -> str:
    """A C text and all it includes of ours as C99 for any compiler. alone: without a heap and words."""
    given = {"beyond.h": "", "mechanism.h": "", "tr_abi.h": header(), "tr_tables.h": tables(), **dict.fromkeys(UNUSED, "")}
    text = one_file(start, in_folders([RUNTIME, NATIVE], given, LEFT), alone)
    text = EXPORT.sub("#define FMU_EXPORT\n", re.sub(r"\brestrict\b", "TR_RESTRICT", text))
    return ascii_only(nothing_unused(used_only(fixed(used_only(text), checked))))


def _seen(made: Mapping[str, str]) -> set[str]:
    """Names that files other than their own see, without those of a standard or of a library."""
    functions = {d.name for text in made.values() for d in definitions(text) if not d.static}
    tables = {t for text in made.values() for t in TABLE.findall(text)}
    return {n for n in functions | tables if not n.startswith(("fmi2", "fmi3", "mechanism_"))}
