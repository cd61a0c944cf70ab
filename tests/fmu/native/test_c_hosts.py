"""The native library in hosts without Python. The tests run on this machine. Slow tests run under wine (Windows) and qemu (64-bit
ARM), if installed."""

from __future__ import annotations

import os
import platform
import re
import shutil
import subprocess
import zipfile
from pathlib import Path

import pytest
from fmpy import read_model_description
from fmpy.fmi1 import FMICallException

from tests.fmu.exported_fmus import FOLDER, exported
from tests.fmu.fmi3.event_mode_host import Host3
from tests.fmu.fmpy_host import Host
from trunnion.fmu.binaries.platform_builds import headers, loader
from trunnion.fmu.scene_export import export
from trunnion.kernel.compilation import c_compiler, library_cache
from trunnion.kernel.compilation.c_compiler import SYSTEM_LIBRARIES, WINDOWS
from trunnion.kernel.shared_libraries import RUNTIME, write_headers

HOST = Path(__file__).with_name("fmi2_host.c")


def built(target: str, out: Path, source: Path = HOST) -> Path:
    """The path of a C host, compiled for a target. Like FMUs, the host uses the system's own libraries. Otherwise the compiler
    would first build its own runtime, for half a minute of processor time."""
    sources, link = [source], ["-nostdlib", "-lc", "-ldl"]
    if "windows" in target:
        sources = [source, WINDOWS]
        more = (f"-lapi-ms-win-crt-{part}-l1-1-0" for part in ("runtime", "convert", "time"))
        link = ["-shared" if out.suffix == ".dll" else "-Wl,-e,mainCRTStartup", *SYSTEM_LIBRARIES["windows"], *more, "-lkernel32"]
    objects = [out.with_name(f"{file.stem}.o") for file in sources]
    for file, made in zip(sources, objects, strict=True):
        what = ["-O1", "-w", f"-I{headers()}", "-c", str(file), "-o", str(made)]
        c_compiler.run(["-target", target, *what], library_cache.cache_folder())
    c_compiler.run(["-target", target, *map(str, objects), "-o", str(out), *link], library_cache.cache_folder())
    return out


def library(fmu: Path, place: str, folder: Path) -> tuple[Path, str]:
    """(the FMU's library unpacked, GUID)."""
    with zipfile.ZipFile(fmu) as z:
        name = next(n for n in z.namelist() if n.startswith(f"binaries/{place}/"))
        return Path(z.extract(name, folder)), read_model_description(fmu).guid


@pytest.mark.skipif(platform.system() != "Linux" or platform.machine() != "x86_64", reason="loads the linux64 library")
@pytest.mark.parametrize("model", ["spherical_pendulum", "crank_slider"])
def test_a_plain_host_can_misuse_an_fmu_and_ten_thousand_instances_leave_nothing_behind(model: str, tmp_path: Path) -> None:
    host = built("x86_64-linux-gnu.2.17", tmp_path / "host")
    file, guid = library(exported(model), "linux64", tmp_path)
    done = subprocess.run([host, file, guid, "10000"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert read_model_description(exported(model)).coSimulation.canNotUseMemoryManagementFunctions, "the host's allocator refuses"
    grown, _, value = done.stdout.split()
    assert int(grown) < 100, "kB; the first hundredth of the instances may warm the allocator up"
    python = Host(exported(model))
    for reference in (len(python.reference), 4_000_000_000):
        with pytest.raises(FMICallException):
            python.fmu.setReal([reference], [0.0])
        assert python.log[-1][1] == f"value reference {reference}: there is no variable with this reference that can be set"
    assert float(value) == python.run(0.0, 10000, 1e-4, python.all_outputs()[0])[-1][0], "the same bits as in fmpy"


@pytest.mark.skipif(platform.system() != "Linux" or platform.machine() != "x86_64", reason="loads the x86_64-linux library")
def test_a_plain_host_of_fmi_3_gets_every_event_and_a_thousand_instances_leave_nothing_behind(tmp_path: Path) -> None:
    host = built("x86_64-linux-gnu.2.17", tmp_path / "host3", HOST.with_name("fmi3_host.c"))
    file, _ = library(exported("spherical_pendulum", fmi=3), "x86_64-linux", tmp_path)
    token = read_model_description(exported("spherical_pendulum", fmi=3)).instantiationToken
    done = subprocess.run([host, file, token, "1000", "10"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    grown, *times = done.stdout.split()
    assert int(grown) < 100, "kB"
    events, _ = Host3(exported("spherical_pendulum", fmi=3)).run(10.0, 0.5)
    assert [float(t) for t in times] == [e[0] for e in events]
    assert len(times) == 11


ARM = Path(os.environ.get("QEMU_LD_PREFIX", "/usr/aarch64-linux-gnu"))
"""The place of the C library of 64-bit ARM; in Debian, the place of the package libc6-arm64-cross."""


def under_qemu(standard: str, folder: Path, *more: str) -> list[float]:
    """The output of a C host with the library of example 8.1 for 64-bit ARM. The test is skipped without qemu, or fails if qemu is
    required."""
    program = shutil.which("qemu-aarch64")
    if program is None or not ARM.is_dir():
        reason = "qemu-user or libc6-arm64-cross is not installed (apt-get install qemu-user libc6-arm64-cross)"
        pytest.fail(reason) if "qemu" in os.environ.get("TRUNNION_REQUIRE", "").replace(",", " ").split() else pytest.skip(reason)
    file = FOLDER / f"arm64-{standard}.fmu"
    export("spherical_pendulum", file, platform="aarch64-linux", fmi=int(standard))
    host = built("aarch64-linux-gnu.2.17", folder / "host", HOST.with_name(f"fmi{standard}_host.c"))
    made, guid = library(file, {"2": "linux64", "3": "aarch64-linux"}[standard], folder)
    told = read_model_description(file)
    words = [program, "-L", ARM, host, made, guid if standard == "2" else told.instantiationToken, *more]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return [float(word) for word in done.stdout.split()]


@pytest.mark.slow
def test_the_library_for_64_bit_arm_finds_the_same_events(tmp_path: Path) -> None:
    """Event times agree to 1e-9 s, because other processors round differently."""
    events, _ = Host3(exported("spherical_pendulum", fmi=3)).run(10.0, 0.5)
    assert under_qemu("3", tmp_path, "2", "10")[1:] == pytest.approx([e[0] for e in events], abs=1e-9)


@pytest.mark.slow
def test_the_library_for_64_bit_arm_in_an_fmu_of_fmi_2_steps_as_that_for_x86_64(tmp_path: Path) -> None:
    expected = Host(exported("spherical_pendulum")).run(0.0, 10000, 1e-4, "pendulum.position[1]")[-1][0]
    assert under_qemu("2", tmp_path, "20")[-1] == pytest.approx(expected, abs=1e-9)


def wine() -> str | None:
    """The path of wine64, also where Debian keeps it outside the PATH."""
    found = shutil.which("wine64") or shutil.which("wine")
    return found or next((str(p) for p in Path("/usr/lib/wine").glob("wine64")), None)


def wanted() -> None:
    """Skip the test if wine is not installed, or fail if wine is required."""
    if wine() is None:
        reason = "wine64 is not installed (Debian: apt-get install wine64)"
        pytest.fail(reason) if "wine" in os.environ.get("TRUNNION_REQUIRE", "").replace(",", " ").split() else pytest.skip(reason)


def under_wine(host: Path, library: Path, guid: str, folder: Path, *more: str) -> list[float]:
    """The output of a C host with a library for Windows."""
    program = wine()
    assert program is not None
    env = dict(os.environ, WINEPREFIX=str(folder / "wine"), WINEDEBUG="-all", HOME=str(folder))
    words = [program, host, library, guid, "20", *more]
    done = subprocess.run(words, capture_output=True, text=True, check=False, env=env, timeout=300)
    assert done.returncode == 0, done.stderr
    return [float(word) for word in done.stdout.split()]


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("target", ["x86_64-windows-gnu", "aarch64-windows-gnu"])
def test_the_runtime_needs_no_function_that_windows_lacks(target: str, tmp_path: Path) -> None:
    """The runtime is compiled without optimisation, so that every function of the C library remains a call. It is then linked as
    FMUs are."""
    write_headers(tmp_path)
    plain = ["-std=c99", "-O0", "-w", "-fno-sanitize=all", "-fno-stack-protector", f"-I{RUNTIME}", f"-I{tmp_path}"]
    sources = (RUNTIME / "runtime.c", WINDOWS)
    made = [tmp_path / f"{source.stem}.o" for source in sources]
    for source, file in zip(sources, made, strict=True):
        c_compiler.run(["-target", target, *plain, "-c", str(source), "-o", str(file)], library_cache.cache_folder())
    link = ["-shared", *map(str, made), "-o", str(tmp_path / "runtime.dll"), *SYSTEM_LIBRARIES["windows"]]
    c_compiler.run(["-target", target, *link], library_cache.cache_folder())


@pytest.mark.slow
def test_the_windows_library_steps_as_the_linux_one(tmp_path: Path) -> None:
    """The motion is the same to 1e-9 m: the C libraries' sines differ in the last bit. The library needs only the system's own C
    library, so that no other library is built for it. The loader of the python flavour works in the same way. wine has no Python,
    so a library in the role of the slave replaces pythonfmu's library."""
    wanted()
    host = built("x86_64-windows-gnu", tmp_path / "host.exe")
    file = FOLDER / "windows.fmu"
    export("spherical_pendulum", file, platform="win64")
    dll, guid = library(file, "win64", tmp_path)
    imports = {name.decode() for name in re.findall(rb"[\w.-]+\.dll", dll.read_bytes())} - {"library.dll"}
    assert imports == {f"api-ms-win-crt-{part}-l1-1-0.dll" for part in ("heap", "math", "private", "stdio", "string")}
    expected = Host(exported("spherical_pendulum")).run(0.0, 10000, 1e-4, "pendulum.position[1]")[-1][0]
    assert under_wine(host, dll, guid, tmp_path)[-1] == pytest.approx(expected, abs=1e-9)
    folder = tmp_path / "un packed #"
    places = {n: folder / n for n in ("binaries/win64", "resources")}
    for place in places.values():
        place.mkdir(parents=True)
    (places["resources"] / "slavemodule.txt").touch()
    shutil.copyfile(dll, places["resources"] / "native.dll")
    built("x86_64-windows-gnu", places["binaries/win64"] / "pythonfmu-export.dll", HOST.with_name("pythonfmu_stub.c"))
    front = places["binaries/win64"] / "model.dll"
    front.write_bytes(loader("win64"))
    assert under_wine(host, front, guid, tmp_path)[-1] == pytest.approx(expected, abs=1e-9)
    claim_that_of_fmi_3_finds_the_same_events(tmp_path)


def claim_that_of_fmi_3_finds_the_same_events(tmp_path: Path) -> None:
    """The check runs in the folder in which wine is already set up."""
    file = FOLDER / "windows-3.fmu"
    export("spherical_pendulum", file, platform="win64", fmi=3)
    host = built("x86_64-windows-gnu", tmp_path / "host3.exe", HOST.with_name("fmi3_host.c"))
    dll, _ = library(file, "x86_64-windows", tmp_path)
    found = under_wine(host, dll, read_model_description(file).instantiationToken, tmp_path, "10")[1:]
    events, _ = Host3(exported("spherical_pendulum", fmi=3)).run(10.0, 0.5)
    assert found == pytest.approx([e[0] for e in events], abs=1e-9)
