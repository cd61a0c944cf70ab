"""Packages from a wheel or an editable installation work from any folder and find their models."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BACKEND = "import sys; sys.path.insert(0, 'engine/packaging'); import build_backend as h; "
BUILD = f"{BACKEND}print(getattr(h, 'build_' + sys.argv[1])(sys.argv[2]))"
REQUIREMENTS = f"{BACKEND}print(getattr(h, 'get_requires_for_build_' + sys.argv[1])())"
SCRIPT = """
import json, trunnion, trunnion.fmu, trunnion.service
from trunnion.scene.library.model_folders import model_names
r = trunnion.simulate("spherical_pendulum", until=0.5)
print(json.dumps([trunnion.__file__, str(trunnion.models_dir()), model_names(), r.outcome.ok]))
"""
TIMEOUT = 300
"""Time limit, s; a slow machine builds a kernel in ten seconds."""


def installed(kind: str, folder: Path) -> Path:
    """Python of a new environment. The environment contains the built project and, by path, the packages that the project needs."""
    # ``engine/parts/test_installation_without_compiler.py`` tests the libraries that are built with a wheel
    env = dict(os.environ, TRUNNION_PREBUILD="0")
    name = subprocess.run(
        [sys.executable, "-c", BUILD, kind, str(folder)], cwd=ROOT, env=env, capture_output=True, text=True, check=True
    ).stdout.split()[-1]
    place = folder / "env"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(place)], check=True)
    python = place / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    ask = "import sysconfig; print(sysconfig.get_path('purelib'))"
    site = Path(subprocess.run([str(python), "-c", ask], capture_output=True, text=True, check=True).stdout.strip())
    zipfile.ZipFile(folder / name).extractall(site)
    (site / "zz_needed.pth").write_text("\n".join({sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}))
    return python


def ask(python: Path, folder: Path, *words: str) -> str:
    """Standard output of Python that runs in another folder, without environment settings that point to this checkout."""
    env = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
    done = subprocess.run([str(python), *words], cwd=folder, env=env, capture_output=True, text=True, timeout=TIMEOUT)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A folder with a wheel that is built once, and Python of an environment in which the wheel is installed. Tests only run this
    Python."""
    folder = tmp_path_factory.mktemp("wheel")
    return folder, installed("wheel", folder)


@pytest.mark.parametrize("kind", ["wheel", "editable"])
def test_an_installation_runs_from_another_folder(kind: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    folder, python = request.getfixturevalue("wheel") if kind == "wheel" else (tmp_path, installed(kind, tmp_path))
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    file, models, names, ok = json.loads(ask(python, elsewhere, "-c", SCRIPT))
    home = folder / "env" if kind == "wheel" else ROOT
    assert Path(file).is_relative_to(home)
    assert Path(models) == (Path(file).parent / "_models" if kind == "wheel" else ROOT / "models")
    assert names == sorted(p.parent.name for p in (ROOT / "models").glob("*/scene.yaml"))
    assert ok


def test_the_wheels_command_draws_and_animates(wheel: tuple[Path, Path], tmp_path: Path) -> None:
    _, python = wheel
    files = ["p.csv", "p.png", "p.html"]
    flags = [w for pair in zip(("-o", "--plot", "--animate"), files, strict=True) for w in pair]
    ask(python, tmp_path, "-m", "trunnion", "simulate", "spherical_pendulum", "--until", "0.5", *flags)
    assert all((tmp_path / f).stat().st_size > 1000 for f in files)


def test_the_wheel_adds_one_package(wheel: tuple[Path, Path]) -> None:
    folder, python = wheel
    with zipfile.ZipFile(next(folder.glob("*.whl"))) as file:
        tops = {name.partition("/")[0] for name in file.namelist()}
    assert tops == {"trunnion", next(t for t in tops if t.endswith(".dist-info"))}
    assert python.exists()


def test_a_users_own_files_of_the_folders_names_hide_nothing(wheel: tuple[Path, Path], tmp_path: Path) -> None:
    """``engine.py``, ``fmu/`` and ``service.py`` beside a user's script remain the user's modules. The script still finds our
    packages."""
    (_, python), beside = wheel, tmp_path / "beside"
    (beside / "fmu").mkdir(parents=True)
    for name in ("engine.py", "service.py", "fmu/__init__.py"):
        (beside / name).write_text("MINE = 1\n")
    ask(python, beside, "-c", "import engine, fmu, service; assert engine.MINE + fmu.MINE + service.MINE == 3\n" + SCRIPT)
    ask(python, beside, "-m", "trunnion", "check", "spherical_pendulum")


@pytest.mark.parametrize(("kind", "prebuild", "compiles"), [("wheel", "1", True), ("wheel", "0", False), ("editable", "1", False)])
def test_only_a_wheel_with_libraries_asks_for_the_compiler(kind: str, prebuild: str, compiles: bool) -> None:
    env = dict(os.environ, TRUNNION_PREBUILD=prebuild)
    told = subprocess.run([sys.executable, "-c", REQUIREMENTS, kind], cwd=ROOT, env=env, capture_output=True, text=True, check=True)
    asked = {name for name in ("casadi", "ziglang", "numpy", "platformdirs") if name in told.stdout.splitlines()[-1]}
    assert asked == ({"casadi", "ziglang", "numpy", "platformdirs"} if compiles else set())
