"""The C files of an exported model, and their lists in ``modelDescription.xml`` or ``buildDescription.xml`` of an FMU. Each file
contains the text of all project headers, and includes only the header ``NAME.h``."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import lru_cache
from xml.etree.ElementTree import Element, SubElement, fromstring

from trunnion.fmu.binaries.platform_builds import NATIVE, SHELL_NAMES, entries
from trunnion.fmu.c_source.array_size_macros import Sizes, sizes_of
from trunnion.fmu.c_text.constant_length_arrays import fixed
from trunnion.fmu.c_text.dead_code_and_ascii import ascii_only, definitions, nothing_unused, renamed, used_only
from trunnion.fmu.c_text.include_expansion import one_file
from trunnion.fmu.variables.exported_model import ExportedModel
from trunnion.fmu.xml_document import xml_bytes
from trunnion.kernel.c_code.code_generator import MATH
from trunnion.kernel.shared_libraries import RUNTIME
from trunnion.runtime.abi.c_header import header
from trunnion.runtime.integrators.method_c_code import header as tables

INTERFACES = ("ModelExchange", "CoSimulation")
LEFT = ("fmi2Functions.h", "fmi3Functions.h")
"""Headers of the FMI standards, which are not expanded because the compiling tool provides them (FMI 2.0, section 2.3; FMI 3.0,
section 2.5.1.2)."""
UNUSED = ("hosts/batch.c", "hosts/lane_batch.c", "hosts/static_friction_ratios.c", "hosts/tangent_integration.c", "output/wear.c")
"""Files of the runtime that exported models do not call."""
CMAKE = """# Builds the library of this FMU for this machine:
#   cmake -S sources -B build -DFMI_HEADERS=FOLDER && cmake --build build --config Release
# FOLDER contains fmi{fmi}Functions.h. Copy the library into the folder of this machine in binaries.
cmake_minimum_required(VERSION 3.10)
project({name} C)
set(FMI_HEADERS "" CACHE PATH "Folder of fmi{fmi}Functions.h")
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()
set(CMAKE_C_STANDARD 99)
set(CMAKE_C_EXTENSIONS OFF)
add_library({name} SHARED {files})
target_include_directories({name} PRIVATE ${{FMI_HEADERS}})
target_compile_definitions({name} PRIVATE FMI{fmi}_OVERRIDE_FUNCTION_PREFIX)
set_target_properties({name} PROPERTIES PREFIX "")
if(UNIX)
  target_link_libraries({name} m)
endif()
"""
TABLE = re.compile(r"^const \w+ (\w+)=", re.MULTILINE)


def texts(units: Mapping[str, str], sizes: Sizes, kind: str, prefix: str, checked: bool = False) -> dict[str, str]:
    """The C files by name. units: generated texts (``ExportedModel.sources``). kind: a key of SHELL_NAMES. prefix: beginning of
    all names with external linkage. checked: whether array lengths are checked at run time (``constant_length_arrays.fixed``)."""
    shell = finished('#include "translation_unit.c"\n', SHELL_NAMES[kind])
    runtime = finished('#include "runtime.c"\n', SHELL_NAMES[kind], checked)
    constant = {"runtime": runtime, "shell": shell, "entry_points": finished(entries(kind))}
    made = constant | {n: _unit(text) for n, text in units.items()}
    names = {n: f"{prefix}_{n}" for n in _seen(made)}
    if kind == "library":
        names |= {n: re.sub("mechanism", prefix, n) for n in set(re.findall(r"\bmechanism\w*", shell + made["entry_points"]))}
        names |= {n: re.sub("MECHANISM", prefix.upper(), n) for n in set(re.findall(r"\bMECHANISM_\w+", shell))}
    head = sizes.text() + (NATIVE / "portable_compiler_settings.h").read_text()
    out = {f"{prefix}_{name}.c": renamed(_begin(name, kind, prefix) + head + text, names) for name, text in made.items()}
    return dict(sorted(out.items()))


def _begin(name: str, kind: str, prefix: str) -> str:
    """The first lines of a file; "" except in ``shell`` and ``entry_points``. The lines include the header, or define the prefix of
    FMI's function names."""
    if name not in ("shell", "entry_points"):
        return ""
    if kind == "library":
        return f'#include "{prefix}.h"\n'
    macro = f"FMI{kind[0]}_FUNCTION_PREFIX"
    return f"#ifndef {macro.replace('_', '_OVERRIDE_', 1)}\n#define {macro} {prefix}_\n#endif\n"


def _unit(text: str) -> str:
    """A generated unit as portable C99."""
    return finished(text.replace(MATH, "#include <math.h>\n").replace("__attribute__((noinline)) ", ""))


@lru_cache(maxsize=1)
def _given() -> dict[str, str]:
    """Texts of two kinds of headers by name: generated headers, and headers that are empty in exported sources."""
    return {"base/compiler.h": "", "mechanism.h": "", "tr_abi.h": header(), "tr_tables.h": tables(), **dict.fromkeys(UNUSED, "")}


@lru_cache(maxsize=8)
def finished(start: str, shell: str = "", checked: bool = False) -> str:
    """A C text as C99 for any compiler, with the includes of the project's files expanded. shell: the macro that selects the parts
    of ``native/translation_unit.c`` (a value of SHELL_NAMES)."""
    text = one_file(start, [RUNTIME, NATIVE], _given(), LEFT, shell)
    text = re.sub(r"\brestrict\b", "TR_RESTRICT", text)
    return ascii_only(nothing_unused(used_only(fixed(used_only(text), checked))))


def _seen(made: Mapping[str, str]) -> set[str]:
    """The names with external linkage, without the function names of FMI and of the C library interface."""
    functions = {d.name for text in made.values() for d in definitions(text) if not d.static}
    tables = {t for text in made.values() for t in TABLE.findall(text)}
    return {n for n in functions | tables if not n.startswith(("fmi2", "fmi3", "mechanism_"))}


def with_sources(documents: Mapping[str, bytes], made: ExportedModel) -> dict[str, bytes]:
    """The documents of an FMU and its C sources. The sources are listed in the file that the standard requires."""
    files = texts(made.sources, sizes_of(made.sources, made.model), made.standard, made.identifier)
    out = dict(documents) | {f"sources/{name}": text.encode() for name, text in files.items()}
    out["sources/CMakeLists.txt"] = CMAKE.format(name=made.identifier, fmi=made.standard[0], files=" ".join(files)).encode()
    if made.standard == "3.0":
        out["sources/buildDescription.xml"] = build_description(made.identifier, list(files))
    else:
        out["modelDescription.xml"] = listing_sources(documents["modelDescription.xml"], list(files))
    return out


def listing_sources(description: bytes, files: Sequence[str]) -> bytes:
    """``modelDescription.xml`` of FMI 2.0 with the list of the C files to compile added."""
    root = fromstring(description)
    for interface in [e for e in root if e.tag in INTERFACES]:
        named = Element("SourceFiles")
        for file in files:
            SubElement(named, "File", {"name": file})
        interface.insert(0, named)
    return xml_bytes(root)


def build_description(identifier: str, files: Sequence[str]) -> bytes:
    """``buildDescription.xml`` of FMI 3.0."""
    root = Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    how = SubElement(root, "BuildConfiguration", {"modelIdentifier": identifier})
    together = SubElement(how, "SourceFileSet", {"language": "C99"})
    for file in files:
        SubElement(together, "SourceFile", {"name": file})
    alone = {"name": "FMI3_OVERRIDE_FUNCTION_PREFIX", "value": "1", "optional": "true"}
    SubElement(together, "PreprocessorDefinition", alone | {"description": "for a shared library: names without a prefix"})
    SubElement(how, "Library", {"name": "m", "external": "false"})
    return xml_bytes(root)
