"""FMUs of the python flavour, built with pythonfmu. The Python slave needs only Python's standard library. The slave calls the
native library, which is in the same folder."""

from __future__ import annotations

import sys
import tempfile
import zipfile
from pathlib import Path
from string import Template

from trunnion.basics.errors import Problem, SceneError
from trunnion.fmu.binaries.platform_builds import PLATFORMS as NATIVE
from trunnion.fmu.binaries.platform_builds import loader

PLATFORMS = ("linux64", "win64")
SLAVE = Path(__file__).with_name("python_flavour_slave.py.txt")
DEPENDENCIES = """This FMU runs Python code in its host's process.

Linux: the process must contain libpython (3.9 or newer). A Python host contains it. Another host must have libpython on its library
path or preload it:
    LD_PRELOAD=libpython3.11.so.1.0 host …
Windows: python3.dll must be on the PATH.
No Python packages are needed beyond the standard library.
The native flavour of the same FMU needs neither libpython nor python3.dll.
"""
REQUIREMENTS = "# the standard library only\n"


def contents(identifier: str, guid: str, libraries: dict[str, bytes]) -> dict[str, bytes]:
    """The files of the FMU by path in the archive, without the model description and the documentation."""
    try:
        from pythonfmu.builder import FmuBuilder
    except ImportError as e:
        raise SceneError([Problem("--flavour", f"pythonfmu cannot be loaded: {e}", "pip install 'trunnion[fmu]'")]) from e
    unique = f"trunnion_{guid.replace('-', '')}"
    text = Template(SLAVE.read_text(encoding="utf-8")).substitute(unique=unique, identifier=identifier)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        script = folder / f"{unique}.py"
        script.write_text(text, encoding="utf-8")
        parts = []
        for platform, data in libraries.items():
            part = folder / platform
            part.mkdir()
            (part / f"{unique}{NATIVE[platform].suffix}").write_bytes(data)
            parts.append(part)
        path = list(sys.path)
        try:
            built = FmuBuilder.build_FMU(script, folder / "built.fmu", parts)
        finally:
            sys.path[:] = path
            sys.modules.pop(unique, None)
        with zipfile.ZipFile(built) as z:
            files = {n: z.read(n) for n in z.namelist() if n != "modelDescription.xml" and not n.endswith("/")}
    files = {n: b for n, b in files.items() if not n.startswith("binaries/") or n.split("/")[1] in libraries}
    for platform in libraries:
        suffix = NATIVE[platform].suffix
        if f"binaries/{platform}/{identifier}{suffix}" not in files:
            what = f"pythonfmu has no library for {platform}; it wrote {', '.join(sorted(files))}"
            raise SceneError([Problem("--flavour", what, "install pythonfmu again, or --flavour native")])
        files[f"binaries/{platform}/pythonfmu-export{suffix}"] = files[f"binaries/{platform}/{identifier}{suffix}"]
        files[f"binaries/{platform}/{identifier}{suffix}"] = loader(platform)
    files["resources/requirements.txt"] = REQUIREMENTS.encode()
    files["documentation/externalDependencies.txt"] = DEPENDENCIES.encode()
    return files
