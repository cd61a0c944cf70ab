"""The kernel cache: incomplete entries are never used, no kernel is compiled twice, and the cache does not grow without bound."""

from __future__ import annotations

import ctypes
import os
import re
import stat
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from trunnion.kernel.compilation import c_compiler, library_cache
from trunnion.kernel.interface.output_columns import columns, select
from trunnion.kernel.shared_libraries import RUNTIME, compiled_runtime, kernel_key, runtime, runtime_key
from trunnion.parts.primitives.primitive_cache import compiled_interpreter
from trunnion.scene import Scene, load_scene
from trunnion.scene.overrides import apply
from trunnion.simulation.run import Model, simulate
from trunnion.system.construction.system_builder import build

ROOT = Path(__file__).parents[3]


@pytest.fixture
def stepping() -> Path:
    """The entry of the runtime in the cache that all tests share."""
    runtime()
    return library_cache.cache_folder() / f"runtime-{runtime_key()}"


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache of this test. It shares only the compiler's intermediate files, which take seconds to make. This process has
    already loaded the runtime from another cache."""
    runtime()
    shared = c_compiler.shared_cache(library_cache.cache_folder())
    shared.mkdir(exist_ok=True)
    folder = tmp_path / "cache"
    folder.mkdir()
    (folder / shared.name).symlink_to(shared)
    monkeypatch.setenv("TRUNNION_CACHE", str(folder))
    return folder


def key(scene: Scene, outputs: tuple[str, ...] = ("pivot*",)) -> str:
    """The cache key of a scene's kernel."""
    return Model(scene, outputs, "compiled").kernel.key


# -- entries ------------------------------------------------------------------------------------------------------------------


def test_an_entry_is_made_once(home: Path) -> None:
    made = []

    def make(folder: Path) -> None:
        made.append(folder)
        (folder / "x").write_text("1")

    first, second = library_cache.entry("thing-1", make), library_cache.entry("thing-1", make)
    assert first == (home / "thing-1", True)
    assert second == (home / "thing-1", False)
    assert len(made) == 1
    assert made[0] != first[0]  # entries are filled under another name, then renamed
    assert (first[0] / "x").read_text() == "1"


def test_a_failed_build_leaves_nothing_in_the_cache(home: Path) -> None:
    def make(folder: Path) -> None:
        (folder / "x").write_text("half")
        raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        library_cache.entry("thing-1", make)
    assert [p.name for p in home.iterdir()] == [c_compiler.shared_cache(home).name]
    assert library_cache.entry("thing-1", lambda folder: (folder / "x").write_text("whole"))[1]
    assert (home / "thing-1" / "x").read_text() == "whole"


def test_a_half_written_entry_is_made_again(home: Path) -> None:
    """After a power cut, a folder has the right name and no mark of completion."""
    scene = load_scene("simple_pendulum")
    built = build(scene)
    chosen = select(columns(built.system), ("pivot*",))
    folder = home / f"kernel-{kernel_key(built.system, len(built.parameters.values), chosen, False, False)}"
    folder.mkdir()
    for name in ("kernel.so", "outputs.so", "facts.json", "kernel.c"):
        (folder / name).write_bytes(b"rubbish")
    kernel = Model(scene, ("pivot*",), "compiled").kernel
    assert kernel.folder == folder
    assert kernel.build_seconds > 0.0
    assert all(f.read_bytes() != b"rubbish" for f in folder.iterdir())


@pytest.mark.slow
def test_two_processes_may_build_the_same_kernel_at_once(stepping: Path, home: Path) -> None:
    """Both processes wait for a signal inside their build. Both get the result, and one copy stays in the cache. The runtime, an
    entry whose build takes seconds, is already there."""
    (home / stepping.name).symlink_to(stepping)
    script = (
        "import sys, time, pathlib\n"
        "from trunnion.simulation.run import simulate\n"
        "from trunnion.kernel.compilation import library_cache\n"
        "entry = library_cache.entry\n"
        "def entry_when_both_are_ready(name, make):\n"
        "    def wait(folder):\n"
        "        if name.startswith('kernel-'): pathlib.Path(sys.argv[2]).touch()\n"
        "        while name.startswith('kernel-') and not pathlib.Path(sys.argv[1]).exists(): time.sleep(0.001)\n"
        "        make(folder)\n"
        "    return entry(name, wait)\n"
        "library_cache.entry = entry_when_both_are_ready\n"
        "r = simulate('crank_slider_free', until=0.1, every=0.1, outputs=['guide.q*'], kernel='compiled')\n"
        "print(r.stats.build_time > 0, repr(float(r['guide.q[1]'][-1])))\n"
    )
    go, ready = home.parent / "go", [home.parent / f"ready{i}" for i in (0, 1)]
    env = dict(os.environ, PYTHONPATH=os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]))
    both = [
        subprocess.Popen([sys.executable, "-c", script, str(go), str(r)], stdout=subprocess.PIPE, env=env, text=True) for r in ready
    ]
    while not all(r.exists() for r in ready):
        assert all(p.poll() is None for p in both)
        time.sleep(0.01)
    go.touch()
    texts = [p.communicate(timeout=300)[0].split() for p in both]
    assert [p.returncode for p in both] == [0, 0]
    assert texts[0] == texts[1]
    assert texts[0][0] == "True"  # neither process found the kernel in the cache
    here = simulate("crank_slider_free", until=0.1, every=0.1, kernel="compiled")
    assert float(texts[0][1]) == pytest.approx(here["guide.q[1]"][-1], abs=1e-12)
    # one entry is from the two processes, the other from the run with all columns above
    assert len(list(home.glob("kernel-*/complete"))) == 2
    assert not [p for p in home.iterdir() if p.name.startswith(".")]


def filled(home: Path, name: str, size: int, age: float) -> Path:
    """An entry of ``size`` bytes that was last used ``age`` seconds ago."""
    folder, _ = library_cache.entry(name, lambda f: (f / "data").write_bytes(b"\0" * size))
    os.utime(folder, (time.time() - age,) * 2)
    return folder


def test_pruning_respects_the_bound_and_takes_the_longest_unused_first(home: Path) -> None:
    old, older, new = filled(home, "a", 1000, 500.0), filled(home, "b", 1000, 900.0), filled(home, "c", 1000, 0.0)
    library_cache.prune(home, max_bytes=2500)
    assert [f.exists() for f in (older, old, new)] == [False, True, True]
    library_cache.entry("a", lambda f: None)  # this use makes "a" the second youngest entry
    os.utime(new, (time.time() - 700.0,) * 2)
    library_cache.prune(home, max_bytes=1500)
    assert [f.exists() for f in (old, new)] == [True, False]


def test_pruning_leaves_recent_libraries_and_those_being_made(home: Path) -> None:
    fresh = filled(home, "a", 1000, 5.0)
    work = home / ".kernel-1-abc"
    work.mkdir()
    abandoned = home / ".kernel-2-abc"
    abandoned.mkdir()
    os.utime(abandoned, (time.time() - 2 * library_cache.STALE_SECONDS,) * 2)
    library_cache.prune(home, max_bytes=0)
    assert [p.exists() for p in (fresh, work, abandoned)] == [True, True, False]


def test_a_process_that_builds_much_does_not_look_through_the_cache_at_every_build(
    home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    looked: list[Path] = []
    monkeypatch.setattr(library_cache, "prune", looked.append)
    for number in range(5):
        library_cache.entry(f"thing-{number}", lambda folder: None)
    assert looked == [home]
    library_cache._pruned[home] -= library_cache.RECENT_SECONDS  # the test sets the last pruning back by this time
    library_cache.entry("thing-5", lambda folder: None)
    assert looked == [home, home]


def test_the_whole_folder_is_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TRUNNION_CACHE", str(tmp_path))
    stale = tmp_path / "zig" / "o" / "0123456789abcdef"
    stale.mkdir(parents=True)
    (stale / "kernel.o").write_bytes(b"\0" * 10_000)
    for path in (stale / "kernel.o", stale, stale.parent, stale.parent.parent):
        os.utime(path, (time.time() - 30 * 86400.0,) * 2)
    library_cache.prune(tmp_path, max_bytes=1000)
    assert sum(f.stat().st_size for f in tmp_path.rglob("*") if f.is_file()) <= 1000


def compile_one(folder: Path, number: int) -> Path:
    """Compile a small library through the cache in ``folder``. Each number gives a different library."""
    source, library = folder / f"f{number}.c", folder / f"f{number}{c_compiler.library_suffix()}"
    source.write_text(f"int f(void) {{ return {number}; }}\n")
    c_compiler.build_library([source], library, [], folder)
    return library


@pytest.mark.slow
def test_builds_do_not_make_the_compilers_cache_grow(tmp_path: Path) -> None:
    def files() -> set[Path]:
        return set(c_compiler.shared_cache(tmp_path).rglob("*"))

    compile_one(tmp_path, 1)
    first = files()
    for number in (2, 3):
        compile_one(tmp_path, number)
    assert files() == first
    assert not [p for p in tmp_path.iterdir() if p.name.startswith(".")]


def test_libraries_carry_no_debugging_tables(tmp_path: Path) -> None:
    """Debugging tables would be most of a library's size, and take a third of the compilation time."""
    assert b".debug_" not in compile_one(tmp_path, 1).read_bytes()


def test_a_build_that_loses_the_compilers_cache_continues(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another process may prune the compiler's cache during the build. In this test, a file replaces the cache's folder."""
    compile_one(tmp_path, 1)
    run, shared = c_compiler._zig, c_compiler.shared_cache(tmp_path)
    tries: list[Path] = []

    def pruned_meanwhile(arguments: Sequence[str], folder: Path, own: Path) -> subprocess.CompletedProcess[str]:
        tries.append(folder)
        if len(tries) == 1:
            library_cache._remove(shared)
            shared.write_text("")  # because of this file, the folder cannot be made again
        return run(arguments, folder, own)

    monkeypatch.setattr(c_compiler, "_zig", pruned_meanwhile)
    assert ctypes.CDLL(str(compile_one(tmp_path, 2))).f() == 2
    assert tries[0] == shared
    assert shared not in tries[1:]


def test_the_compilers_cache_is_left_alone_while_builds_may_use_it(tmp_path: Path) -> None:
    shared = c_compiler.shared_cache(tmp_path)
    shared.mkdir()
    (shared / "libc.o").write_bytes(b"\0" * 10_000)
    for age, left in ((60.0, True), (2 * library_cache.COMPILER_SECONDS, False)):
        os.utime(shared, (time.time() - age,) * 2)
        library_cache.prune(tmp_path, max_bytes=1000)
        assert shared.exists() == left


# -- keys ---------------------------------------------------------------------------------------------------------------------


def test_a_scene_with_other_values_has_the_same_kernel() -> None:
    scene = load_scene("simple_pendulum")
    base = key(scene)
    for path, value in (
        ("gravity", [0, -1.6, 0]),
        ("bodies.bob.mass", 7.0),
        ("joints.pivot.start.q", 0.4),
        ("simulation.rtol", 1e-3),
    ):
        assert key(apply(scene, {path: value})) == base, path
    heavy = apply(scene, {"bodies.bob.mass": 3.0})
    assert simulate(heavy, until=0.1, outputs=["pivot*"], kernel="compiled").stats.build_time == 0.0


def test_a_zero_that_is_zero_no_more_is_another_kernel_unless_it_is_tunable() -> None:
    scene = load_scene("simple_pendulum")
    tilted = apply(scene, {"gravity": [1.0, -9.81, 0]})
    assert key(tilted) != key(scene)
    tunable = [replace(s, tunable=("gravity*",)) for s in (scene, tilted)]
    assert key(tunable[0]) == key(tunable[1])
    assert key(tunable[0]) not in (key(scene), key(tilted))
    assert simulate(tunable[1], until=1.0)["pivot.q[1]"] == pytest.approx(simulate(tilted, until=1.0)["pivot.q[1]"], abs=1e-9)


def test_a_single_component_can_be_tunable() -> None:
    scene = replace(load_scene("simple_pendulum"), tunable=("gravity[1]",))
    assert "gravity[1]" in Model(scene, ("pivot*",)).built.parameters.paths


def test_other_columns_are_another_kernel_and_the_order_of_the_file_is_not() -> None:
    scene = load_scene("crank_slider_free")
    turned = replace(scene, bodies=dict(reversed(scene.bodies.items())), joints=dict(reversed(scene.joints.items())))
    assert key(scene, ("guide*",)) != key(scene, ("slider*",))
    assert key(turned, ("guide*",)) == key(scene, ("guide*",))


def test_equal_code_is_compiled_once(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Other columns leave the stepping unit unchanged. Other names leave all units unchanged."""
    compiled: list[str] = []
    build_library = c_compiler.build_library

    def watched(sources: Sequence[Path], library: Path, *others: object) -> None:
        compiled.extend(s.stem for s in sources)
        build_library(sources, library, *others)  # type: ignore[arg-type]

    monkeypatch.setattr(c_compiler, "build_library", watched)
    scene = load_scene("simple_pendulum")
    first = key(scene)
    assert {"kernel", "outputs"} <= set(compiled)  # each process also compiles the runtime once
    compiled.clear()
    assert key(scene, ("pivot.q*",)) != first
    assert compiled == ["outputs"]
    compiled.clear()
    named = replace(scene, joints={"hinge": scene.joints["pivot"]})
    assert key(named, ("hinge*",)) != first
    assert compiled == []


def test_a_warm_start_needs_neither_the_symbolic_library_nor_the_compiler() -> None:
    simulate("simple_pendulum", until=0.1)
    script = (
        "import sys; from trunnion.simulation.run import simulate\n"
        "r = simulate('simple_pendulum', until=0.1); print('casadi' in sys.modules, len(r))"
    )
    env = dict(os.environ, PYTHONPATH=os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]))
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=env, check=True)
    assert done.stdout.split()[0] == "False"


def sources_of(arguments: Sequence[str]) -> set[Path]:
    """The C files that a call of the compiler reads: named files and included files."""
    folders = [Path(a[2:]) for a in arguments if a.startswith("-I")]
    found, waiting = set(), [Path(a) for a in arguments if a.endswith(".c")]
    while waiting:
        file = waiting.pop()
        if file not in found:
            found.add(file)
            names = re.findall(r'#include "(.*?)"', file.read_text())
            waiting += [p.resolve() for name in names for p in (d / name for d in (file.parent, *folders)) if p.exists()]
    return found


@pytest.mark.parametrize("tag", ["manylinux_2_17_x86_64", "win_amd64"])
@pytest.mark.parametrize("library", [compiled_runtime, compiled_interpreter])
def test_the_key_of_a_library_covers_every_file_that_the_compiler_reads(
    library: Callable[..., Path], tag: str, home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiled: set[Path] = set()
    keyed: set[str] = set()

    def compile_nothing(arguments: Sequence[str], _: Path) -> None:
        compiled.update(sources_of(arguments))
        Path(arguments[arguments.index("-o") + 1]).touch()

    def remember(*parts: str | bytes) -> str:
        keyed.update(p if isinstance(p, str) else p.decode() for p in parts)
        return "key"

    runtime_key.cache_clear()
    monkeypatch.setattr(c_compiler, "run", compile_nothing)
    monkeypatch.setattr(library_cache, "digest", remember)
    library(c_compiler.MACHINES[tag])
    runtime_key.cache_clear()
    given = {file for file in compiled if not file.is_relative_to(home)}
    assert (c_compiler.WINDOWS in given) == (tag == "win_amd64")
    assert len(given) > 4
    assert {file for file in given if file.read_text() not in keyed} == set()


# -- places and failures ------------------------------------------------------------------------------------------------------


def test_a_folder_is_made_for_the_user_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TRUNNION_CACHE", str(tmp_path / "new" / "cache"))
    assert library_cache.cache_folder() == tmp_path / "new" / "cache"
    assert stat.S_IMODE(library_cache.cache_folder().stat().st_mode) == 0o700


@pytest.mark.skipif(sys.platform != "linux", reason="the folders of this platform")
def test_the_cache_is_where_the_platform_keeps_caches(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On Linux, XDG's variable determines the place. The variables of other platforms have no effect."""
    monkeypatch.delenv("TRUNNION_CACHE", raising=False)
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path / "elsewhere"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert library_cache.cache_folder() == tmp_path / "trunnion"
    assert stat.S_IMODE(library_cache.cache_folder().stat().st_mode) == 0o700


def test_without_a_place_to_write_a_private_temporary_folder_is_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setattr(library_cache, "_temporary", None)
    monkeypatch.setenv("TRUNNION_CACHE", str(tmp_path / "file" / "cache"))
    folder = library_cache.cache_folder()
    assert folder == library_cache.cache_folder()
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert library_cache.entry("thing-1", lambda f: None) == (folder / "thing-1", True)
    monkeypatch.delenv("TRUNNION_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    monkeypatch.delenv("LOCALAPPDATA", raising=False)
    assert library_cache.cache_folder() == folder


def test_code_that_does_not_compile_is_reported_as_our_defect(home: Path) -> None:
    source = home / "kernel.c"
    source.write_text("void f(void){ this is no C; }\n")
    with pytest.raises(c_compiler.CompilerError, match="defect of Trunnion, please report") as caught:
        c_compiler.build_library([source], home / "kernel.so", [RUNTIME], library_cache.cache_folder())
    assert "kernel.c:1" in str(caught.value)
    assert not (home / "kernel.so").exists()
    assert len(str(caught.value)) < 2500  # the error quotes only the end of the compiler's message
