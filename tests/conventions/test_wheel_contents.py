"""A wheel contains exactly the files that installed code imports or reads."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
import zipfile
from functools import cache
from pathlib import Path

import pytest
from setuptools import Distribution

from tests.conventions.parsed_sources import syntax_of
from trunnion.packaging.setuptools_commands import MODEL_FILE, PACKAGES, ROOT, BuildPy
from trunnion.scene.library.model_folders import bundled_names

LOADED_BY_OTHERS = ("trunnion.service.store.migrations.",)
"""Modules that a library loads from a folder (Alembic)."""
HASHED = {"trunnion.parts.primitives.library_prebuild"}
"""The module that builds the libraries of a wheel. ``prebuilt_libraries.sources`` reads this file, because a library is used only
with the sources from which it was built."""
READ_BY_OTHERS = {"py.typed"}
"""Files that tools read (type checkers)."""


@cache
def wheel_files() -> tuple[dict[str, Path], list[Path]]:
    """Modules by name, and the other files of a wheel by their paths in the checkout."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        command = BuildPy(Distribution({"package_dir": dict(PACKAGES), "script_name": "setup.py"}))
        command.ensure_finalized()
        modules = {f"{p}.{m}".removesuffix(".__init__"): ROOT / f for p, m, f in command.find_all_modules()}
        data = [ROOT / source / f for _, source, _, files in command.data_files for f in files]
    return modules, [f for f in data if f.suffix != ".py"]


@cache
def imports(module: str) -> frozenset[str]:
    """Modules of a wheel that a module imports, with their parent packages, or that a text names. A text names a module as ``a.b``,
    as ``a.b:c``, or as ``b``. ``b`` counts if the module is in the package of ``b``, or if the text names this package."""
    modules, found = wheel_files()[0], {module.rpartition(".")[0]}
    parts = syntax_of(modules[module])
    package = module if modules[module].name == "__init__.py" else module.rpartition(".")[0]
    starts = ["", "trunnion.", f"{package}.", *(t.removesuffix(".") + "." for t in parts.texts if t.startswith("trunnion."))]
    found |= parts.imported()
    found |= {start + re.split("[:.]", text)[0] if start else text.partition(":")[0] for start in starts for text in parts.texts}
    return frozenset(found & set(modules))


def test_every_module_is_reached_from_an_entry_point() -> None:
    modules = wheel_files()[0]
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    entries = project["scripts"].values()
    reached = {*PACKAGES, *HASHED, *(e.partition(":")[0] for e in entries), *(m for m in modules if m.endswith(".__main__"))}
    reached |= {m for m in modules if m.startswith(LOADED_BY_OTHERS)}
    waiting = list(reached)
    while waiting:
        new = imports(waiting.pop()) - reached
        reached |= new
        waiting += new
    assert sorted(set(modules) - reached) == []


def test_installed_code_imports_no_module_of_the_checkout_alone() -> None:
    modules = wheel_files()[0]
    named = [(module, name) for module, file in modules.items() for name, _ in syntax_of(file).names]
    assert [f"{m}: {name}" for m, name in named if name.partition(".")[0] in ("trunnion", "tests") and name not in modules] == []


def test_every_other_file_is_named_by_an_installed_file() -> None:
    modules, data = wheel_files()
    texts = {f: f.read_text(encoding="utf-8") for f in [*modules.values(), *data]}
    names = {f: f.stem if f.suffix in (".txt", ".hpp") else f.name for f in data if f.name not in READ_BY_OTHERS}
    any_name = re.compile(rf"(?<![\w.-])(?:{'|'.join(sorted(map(re.escape, set(names.values())), key=len, reverse=True))})")
    found = {f: set(any_name.findall(text)) for f, text in texts.items()}
    unnamed = [f for f, name in names.items() if not any(name in said for other, said in found.items() if other != f)]
    assert [f.relative_to(ROOT).as_posix() for f in unnamed] == []


def test_a_wheel_holds_of_the_models_only_named_scenes() -> None:
    assert sorted(f.parent.name for f in (ROOT / "models").rglob(MODEL_FILE)) == sorted(bundled_names())


def test_the_wheel_holds_the_services_page_and_the_migrations(tmp_path: Path) -> None:
    build_wheel = "import sys; from setuptools.build_meta import build_wheel; print(build_wheel(sys.argv[1]))"
    env = dict(os.environ, TRUNNION_PREBUILD="0")
    ask = [sys.executable, "-c", build_wheel, str(tmp_path)]
    done = subprocess.run(ask, cwd=ROOT, env=env, capture_output=True, text=True, check=True)
    names = zipfile.ZipFile(tmp_path / done.stdout.split()[-1]).namelist()
    for folder in ("page", "store/migrations", "store/migrations/versions"):
        here = [f for f in (ROOT / "service" / folder).iterdir() if f.is_file() and f.suffix != ".mako"]
        assert {f"trunnion/service/{folder}/{f.name}" for f in here} <= set(names)
    assert "trunnion/runtime/hosts/batch.c" in names
