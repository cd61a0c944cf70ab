"""An installed Trunnion has the parts of its scenes: it runs them without a compiler and without symbols, and where it cannot it
says what to install. What is kept of a part is what writing it anew gives."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from engine.kernel import built, cache
from engine.kernel.columns import columns, needs_quadratures
from engine.parts import memory, store
from engine.parts.building import build
from engine.parts.every import Asked, every
from engine.parts.kernel import parts_kernel
from engine.parts.known import Part
from engine.parts.rates import jacobian
from engine.parts.sensitive import linear_columns, linear_rates
from engine.parts.smooth import Smooth
from engine.scene import load_scene
from engine.scene.library import model_names
from engine.scene.model import Scene
from engine.system.build import build as system_of
from engine.system.structure import System
from tests.engine.test_parts import LOOPS, TREES, loop, tree

ROOT = Path(__file__).resolve().parents[2]
MODEL = "spherical_pendulum"
LEFT_OUT = re.compile(r"([iv]?p|k_sprung)_free_\w*[0-9]|f_\w+_adams_|f_\w+_pressed_soft|f_\w+_contacts_at")
"""Free bodies of which one or two freedoms are prescribed; Adams' approximation with laws that it is not compared with; friction in
loops of joints with a stiffness of their own; derivatives of contacts under other laws."""
WITHOUT = """
import sys
from pathlib import Path
sys.modules["casadi"] = sys.modules["ziglang"] = None  # as if they were not installed
from engine.kernel import built
built.FOLDER = Path(sys.argv[1])
from engine import cli
sys.argv = ["trunnion", *sys.argv[2:]]
sys.exit(cli.main())
"""


def used(scene: Scene) -> dict[str, Part]:
    """The parts of a scene's kernel with all columns, of its Jacobian and of its linear unit, by their keys."""
    found: dict[str, Part] = {}

    def noted(parts: list[Part]) -> list[object]:
        found.update((p.key, p) for p in parts)
        return libraries(parts)

    libraries = store.libraries
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(memory, "libraries", noted)
        made = system_of(scene)
        chosen = columns(made.system)
        for redundant in (False, bool(made.system.cuts and made.system.frictional)):
            kernel = parts_kernel(made.system, len(made.parameters.values), chosen, needs_quadratures(chosen), redundant)
            found |= {p.key: p for s in derived(made.system, kernel.facts["active_rows"], redundant) for p in s.part_of.values()}
    return found


def derived(system: System, active: list[int], redundant: bool) -> list[Smooth]:
    """Scenes of the Jacobian, and of the linear unit of all columns."""
    scene = Smooth(system)
    jacobian(scene, active, redundant)
    return [scene, linear_rates(system, active).scene, linear_columns(system, columns(system)).scene]


@pytest.fixture(scope="module")
def listed() -> dict[str, Asked]:
    """Every part that comes with an installation, by its key."""
    return {store.key_of(*asked): asked for asked in every()}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, listed: dict[str, Asked]) -> Path:
    """Libraries as they come with an installation, with the parts of one model."""
    place = tmp_path_factory.mktemp("installed")
    build(place / built.level(), [listed[key] for key in used(load_scene(MODEL))])
    return place


def trunnion(home: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """The command in an installation that has these libraries but neither compiler nor symbolic library, and an empty cache."""
    empty = home.parent / "cache"
    env = dict(os.environ, PYTHONPATH=str(ROOT), TRUNNION_CACHE=str(empty))
    return subprocess.run([sys.executable, "-c", WITHOUT, str(home), *words], env=env, capture_output=True, text=True, timeout=100)


def test_an_installed_scene_runs_without_compiler_and_symbols(folder: Path, tmp_path: Path) -> None:
    done = trunnion(folder, "simulate", MODEL, "--kernel", "parts", "--until", "1", "-o", str(tmp_path / "p.csv"))
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "p.csv").stat().st_size > 1000
    assert not list((folder.parent / "cache").glob("part-*"))


def test_what_is_not_there_and_cannot_be_compiled_is_told_with_the_remedy(folder: Path) -> None:
    for words in (["double_pendulum", "--kernel", "parts"], [MODEL, "--kernel", "compiled"]):
        done = trunnion(folder, "simulate", *words)
        told = (done.stdout + done.stderr).strip()
        assert done.returncode == 2, told
        remedy = r"→ pip install 'trunnion\[compile\]'(; or --kernel parts.*)?"
        assert re.fullmatch(rf"this .* casadi and ziglang, are not installed\n *{remedy}", told)
        assert ("--kernel parts" in told) == ("compiled" in words)


def test_libraries_of_other_sources_are_not_used(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(built, "FOLDER", folder)
    assert built.folder.__wrapped__() == folder / built.level()
    told = folder / built.level() / built.TOLD
    right = told.read_text()
    told.write_text(cache.digest("others"))
    assert built.folder.__wrapped__() is None
    told.write_text(right)


def test_a_checkout_takes_the_libraries_of_an_installation_of_its_sources(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Python that is started in a checkout imports it, and not what was installed."""
    monkeypatch.setattr(built, "FOLDER", tmp_path / "none" / "_built")
    (tmp_path / "site" / "engine").mkdir(parents=True)
    (tmp_path / "site" / "engine" / "_built").symlink_to(folder)
    assert built.folder.__wrapped__() is None
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    assert built.folder.__wrapped__() == tmp_path / "site" / "engine" / "_built" / built.level()


@pytest.mark.parametrize("name", model_names())
def test_every_part_of_a_model_comes_with_an_installation(name: str, listed: dict[str, Asked]) -> None:
    assert not [p.first for key, p in used(load_scene(name)).items() if key not in listed]


def test_every_part_of_a_random_scene_comes_with_an_installation(listed: dict[str, Asked]) -> None:
    scenes = [*map(tree, TREES), *map(loop, LOOPS)]
    missing = [p.first for scene in scenes for key, p in used(scene).items() if key not in listed]
    assert not [name for name in missing if not LEFT_OUT.match(name)]


def test_what_is_kept_of_a_part_is_what_writing_it_anew_gives(folder: Path, listed: dict[str, Asked]) -> None:
    parts = used(load_scene(MODEL))
    store.libraries(list(parts.values()))
    assert all(store._known(key) for key in parts)
    for key, kept in parts.items():
        anew = store.written(*listed[key])
        assert store.facts(kept) == store.facts(anew)
        assert store.facts(kept) == store.facts(store._known(key) or anew)


def test_a_part_that_was_pruned_since_it_was_met_is_made_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A process keeps what it knows of parts as long as it lives; the cache keeps them while they are used."""
    monkeypatch.setenv("TRUNNION_CACHE", str(tmp_path))
    asked = ("small", "signal", "rate", True)
    store.libraries([store.part(*asked)])
    met = store.part(*asked)
    assert met.library.startswith(str(tmp_path))
    cache.prune(tmp_path, 0)  # too recent
    assert Path(met.library).exists()
    for entry in tmp_path.iterdir():
        os.utime(entry, (0, 0))
    cache.prune(tmp_path, 0)
    assert not Path(met.library).exists()
    (again,) = store.libraries([met])
    assert getattr(again, met.first)
    assert Path(met.library).exists()
    assert store.part(*asked).library == met.library


def test_the_build_of_a_wheel_needs_nothing_but_what_it_asks_for() -> None:
    asked = re.search(r"^requires = (\[.*\])$", (ROOT / "pyproject.toml").read_text(encoding="utf-8"), re.MULTILINE)
    assert asked is not None
    assert "pydantic" not in asked.group(1)
    blocked = "import sys\nfor name in ('pydantic', 'yaml', 'typer', 'scipy', 'matplotlib'):\n    sys.modules[name] = None\n"
    done = subprocess.run(
        [sys.executable, "-c", f"{blocked}import engine.parts.building"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
