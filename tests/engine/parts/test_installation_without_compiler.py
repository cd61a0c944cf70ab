"""An installed Trunnion contains the parts of its scenes. It runs these scenes without a compiler and without the symbolic library.
If it cannot run a scene, the error names the package to install. The stored source of a part equals newly written source."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.default_case_selection import sampled
from tests.engine.parts.test_compiled_kernel_equivalence import LOOPS, TREES, loop, tree
from trunnion.kernel.compilation import library_cache, prebuilt_libraries
from trunnion.kernel.interface.output_columns import columns, needs_quadratures
from trunnion.parts.derivatives.acceleration_derivatives import DifferentiableScene
from trunnion.parts.derivatives.jacobian import jacobian
from trunnion.parts.derivatives.linear_and_sensitivity_units import linear_columns, linear_rates
from trunnion.parts.kernels import tables_in_memory
from trunnion.parts.kernels.scene_kernel import parts_kernel
from trunnion.parts.primitives import primitive_cache as store
from trunnion.parts.primitives.catalogue import Recipe, every
from trunnion.parts.primitives.library_prebuild import build
from trunnion.parts.primitives.primitive_keys import Primitive
from trunnion.scene import load_scene
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.library.model_folders import model_names
from trunnion.system.construction.system_builder import build as system_of
from trunnion.system.structure.bodies_and_joints import System

ROOT = Path(__file__).resolve().parents[3]
MODEL = "spherical_pendulum"
LEFT_OUT = re.compile(r"([iv]?p|k_sprung)_free_\w*[0-9]|(o_contact_)?f_\w+_adams_|f_\w+_pressed_soft|o_contact_f_\w+_at")
"""Parts that are left out: free bodies of which one or two freedoms are prescribed; Adams' approximation with laws that it is not
compared with; friction in loops of joints with a stiffness of their own; derivatives of contacts under other laws."""
WITHOUT = """
import sys
from pathlib import Path
sys.modules["casadi"] = sys.modules["ziglang"] = None  # as if they were not installed
from trunnion.kernel.compilation import prebuilt_libraries as built
built.FOLDER = Path(sys.argv[1])
from trunnion import cli
sys.argv = ["trunnion", *sys.argv[2:]]
sys.exit(cli.main())
"""


def used(scene: Scene) -> dict[str, Primitive]:
    """The parts of a scene's kernel with all columns, of its Jacobian and of its linear unit, by their keys."""
    found: dict[str, Primitive] = {}

    def noted(parts: list[Primitive]) -> list[object]:
        found.update((p.key, p) for p in parts)
        return libraries(parts)

    libraries = store.libraries
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tables_in_memory, "libraries", noted)
        made = system_of(scene)
        chosen = columns(made.system)
        for redundant in (False, bool(made.system.cuts and made.system.frictional)):
            kernel = parts_kernel(made.system, len(made.parameters.values), chosen, needs_quadratures(chosen), redundant)
            scenes = derived(made.system, kernel.facts["active_rows"], redundant)
            found |= {p.key: p for s in scenes for p in s.primitive_of.values()}
    return found


def derived(system: System, active: list[int], redundant: bool) -> list[DifferentiableScene]:
    """Scenes of the Jacobian, and of the linear unit of all columns."""
    scene = DifferentiableScene(system)
    jacobian(scene, active, redundant)
    return [scene, linear_rates(system, active).scene, linear_columns(system, columns(system)).scene]


@pytest.fixture(scope="module")
def listed() -> dict[str, Recipe]:
    """Every part that an installation contains, by its key."""
    return {store.key_of(*asked): asked for asked in every()}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, listed: dict[str, Recipe]) -> Path:
    """A folder of libraries as in an installation, with the parts of one model."""
    place = tmp_path_factory.mktemp("installed")
    build(place / prebuilt_libraries.level(), [listed[key] for key in used(load_scene(MODEL))])
    return place


def trunnion(home: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """The command in an installation that has these libraries, an empty cache, and neither compiler nor symbolic library."""
    empty = home.parent / "cache"
    env = dict(os.environ, PYTHONPATH=str(ROOT), TRUNNION_CACHE=str(empty))
    return subprocess.run([sys.executable, "-c", WITHOUT, str(home), *words], env=env, capture_output=True, text=True, timeout=100)


def test_an_installed_scene_runs_without_compiler_and_symbols(folder: Path, tmp_path: Path) -> None:
    done = trunnion(folder, "simulate", MODEL, "--kernel", "parts", "--until", "1", "-o", str(tmp_path / "p.csv"))
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "p.csv").stat().st_size > 1000
    assert not list((folder.parent / "cache").glob("part-*"))
    unpacked = {f.name.split("-")[1] for f in (folder.parent / "cache").glob("installed-*")}
    assert unpacked == {"all", *(j.type for j in load_scene(MODEL).joints.values())}


def test_a_pruned_library_is_unpacked_again(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TRUNNION_CACHE", str(tmp_path))
    monkeypatch.setattr(prebuilt_libraries, "_packed", lambda: packed)
    monkeypatch.setattr(store, "_unpacked", prebuilt_libraries.unpacked)
    packed = {f.stem.rpartition("-")[0]: f for f in folder.glob(f"*/{prebuilt_libraries.PACKED}/*")}
    met = store.primitive("signals_loads_energies", "energies")
    assert Path(met.library).parent.name.startswith("installed-all-")
    shutil.rmtree(Path(met.library).parent)
    (again,) = store.libraries([met])
    assert getattr(again, met.first)
    assert Path(met.library).exists()


def test_a_missing_library_that_cannot_be_compiled_is_reported_with_its_remedy(folder: Path) -> None:
    for words in (["double_pendulum", "--kernel", "parts"], [MODEL, "--kernel", "compiled"]):
        done = trunnion(folder, "simulate", *words)
        told = (done.stdout + done.stderr).strip()
        assert done.returncode == 2, told
        remedy = r"→ pip install 'trunnion\[compile\]'(; or use --kernel parts.*)?"
        assert re.fullmatch(rf"this .* casadi and ziglang, are not installed\n *{remedy}", told)
        assert ("--kernel parts" in told) == ("compiled" in words)


def test_libraries_of_other_sources_are_not_used(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(prebuilt_libraries, "FOLDER", folder)
    assert prebuilt_libraries.folder.__wrapped__() == folder / prebuilt_libraries.level()
    told = folder / prebuilt_libraries.level() / prebuilt_libraries.TOLD
    right = told.read_text()
    told.write_text(library_cache.digest("others"))
    assert prebuilt_libraries.folder.__wrapped__() is None
    told.write_text(right)


def test_functions_of_every_contact_have_names_that_c_allows(listed: dict[str, Recipe]) -> None:
    parts = [store.build_primitive(*asked) for asked in listed.values() if asked[1] in ("pin", "bearing", "tie")]
    assert len(parts) > 100
    assert not [p.first for p in parts if not (p.first.isascii() and p.first.isidentifier())]


@pytest.mark.parametrize("name", sampled([*model_names(), "winch"], (MODEL, "winch")))
def test_every_part_of_a_model_comes_with_an_installation(name: str, listed: dict[str, Recipe]) -> None:
    assert not [p.first for key, p in used(load_scene(name)).items() if key not in listed]


@pytest.mark.slow
def test_every_part_of_a_random_scene_comes_with_an_installation(listed: dict[str, Recipe]) -> None:
    scenes = [*map(tree, TREES), *map(loop, LOOPS)]
    missing = [p.first for scene in scenes for key, p in used(scene).items() if key not in listed]
    assert not [name for name in missing if not LEFT_OUT.match(name)]


def test_stored_facts_of_a_part_equal_those_of_a_new_build(folder: Path, listed: dict[str, Recipe]) -> None:
    parts = used(load_scene(MODEL))
    store.libraries(list(parts.values()))
    assert all(store._cached(key) for key in parts)
    for key, kept in parts.items():
        anew = store.build_primitive(*listed[key])
        assert store.facts_of(kept) == store.facts_of(anew)
        assert store.facts_of(kept) == store.facts_of(store._cached(key) or anew)


@pytest.mark.slow
def test_a_part_that_was_pruned_since_it_was_met_is_made_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A process remembers parts for its whole life. The cache keeps a part only while the part is used."""
    monkeypatch.setenv("TRUNNION_CACHE", str(tmp_path))
    asked = ("signals_loads_energies", "signal", "rate", True)
    store.libraries([store.primitive(*asked)])
    met = store.primitive(*asked)
    assert met.library.startswith(str(tmp_path))
    library_cache.prune(tmp_path, 0)  # the part was used too recently to be pruned
    assert Path(met.library).exists()
    for entry in tmp_path.iterdir():
        os.utime(entry, (0, 0))
    library_cache.prune(tmp_path, 0)
    assert not Path(met.library).exists()
    (again,) = store.libraries([met])
    assert getattr(again, met.first)
    assert Path(met.library).exists()
    assert store.primitive(*asked).library == met.library


def test_missing_parts_are_compiled_together_once_and_each_is_found_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TRUNNION_CACHE", str(tmp_path))
    asked = [("signals_loads_energies", "signal", kind, moves) for kind in ("ramp", "trapezoid") for moves in (False, True)]
    met = [store.primitive(*recipe) for recipe in asked]
    store.libraries(met[:3])
    assert len(list(tmp_path.glob("part-*"))) == 1
    libraries = store.libraries(met)  # this process knew the first three parts before they were compiled
    assert len(list(tmp_path.glob("part-*"))) == 2
    assert all(getattr(library, p.first) for library, p in zip(libraries, met, strict=True))
    assert [store.primitive(*recipe).library for recipe in asked] == [library._name for library in libraries]


def test_the_build_of_a_wheel_needs_nothing_but_what_it_asks_for() -> None:
    ask = "import sys; sys.path.insert(0, 'engine/packaging'); import build_backend as b; print(b.get_requires_for_build_wheel())"
    env = dict(os.environ, TRUNNION_PREBUILD="1")
    asked = subprocess.run([sys.executable, "-c", ask], cwd=ROOT, env=env, capture_output=True, text=True, check=True).stdout
    assert "casadi" in asked
    assert not any(name in asked.lower() for name in ("yaml", "typer", "scipy", "matplotlib"))
    blocked = "import sys\nfor name in ('yaml', 'typer', 'scipy', 'matplotlib'):\n    sys.modules[name] = None\n"
    done = subprocess.run(
        [sys.executable, "-c", f"{blocked}import trunnion.parts.primitives.library_prebuild"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
