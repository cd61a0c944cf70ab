"""Libraries in wheels for other platforms need only libraries that every system of the platform has. Two builds give the same
bytes."""

from __future__ import annotations

import lzma
import re
from pathlib import Path

import pytest

from tests.conventions.shared_library_dependencies import needs
from trunnion.kernel.compilation import prebuilt_libraries
from trunnion.kernel.compilation.c_compiler import MACHINES, Machine
from trunnion.packaging.platform_wheels import SUMS, write_checksums
from trunnion.parts.primitives.library_prebuild import build

RECIPES = [("signals_loads_energies", "signal", kind, moves) for kind in ("ramp", "trapezoid") for moves in (False, True)]
SYSTEM = {
    "linux": r"lib[cm]\.so(\.6)?|libc\.musl-.*",
    "macos": r"/usr/lib/libSystem\.B\.dylib",
    "windows": r"api-ms-win-crt-\w+-l1-1-0\.dll",
}
"""{system: names of the libraries that each of its installations has}."""


def lowest(tag: str) -> tuple[int, ...]:
    """The lowest system version of a platform tag: glibc 2.17, macOS 11.0. () for other tags."""
    found = re.match(r"(?:manylinux|macosx)_(\d+)_(\d+)", tag)
    return tuple(map(int, found.groups())) if found else ()


def built(folder: Path, machine: Machine) -> dict[str, bytes]:
    build(folder, RECIPES, machine)
    return {f.relative_to(folder).as_posix(): f.read_bytes() for f in folder.rglob("*") if f.is_file()}


@pytest.mark.slow
@pytest.mark.parametrize("tag", MACHINES)
def test_libraries_of_a_platform_need_only_what_it_promises(tag: str, tmp_path: Path) -> None:
    machine = MACHINES[tag]
    made = built(tmp_path, machine)
    (packed,) = (name for name in made if name.startswith(f"{prebuilt_libraries.PACKED}/"))
    (tmp_path / "parts").write_bytes(lzma.decompress(made.pop(packed)))
    assert set(made) == {"sources", *(f"{name}{machine.suffix}" for name in ("runtime", "interpreter"))}
    for name in {*made, "parts"} - {"sources"}:
        found = needs(tmp_path / name)
        assert (found.system, found.processor) == (machine.system, machine.target.partition("-")[0])
        assert not [x for x in found.libraries if not re.fullmatch(SYSTEM[machine.system], x)]
        assert not [v for v in found.minimum if v > lowest(tag)]


@pytest.mark.slow
@pytest.mark.parametrize("tag", ["manylinux_2_17_x86_64", "macosx_11_0_arm64", "win_amd64"])
def test_two_builds_without_a_common_cache_give_the_same_bytes(tag: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = []
    for name in ("first", "second"):
        monkeypatch.setenv("TRUNNION_CACHE", str(tmp_path / f"cache-{name}"))
        made.append(built(tmp_path / name, MACHINES[tag]))
    assert made[0] == made[1]


def test_checksums_are_those_of_the_wheels(tmp_path: Path) -> None:
    (tmp_path / "a.whl").write_bytes(b"abc")
    write_checksums(tmp_path)
    known = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"  # the example of FIPS 180-2, appendix B.1
    assert (tmp_path / SUMS).read_text() == f"{known}  a.whl\n"
