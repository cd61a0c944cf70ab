"""Commands of setuptools that build Trunnion's wheels: one package ``trunnion`` from three folders, with the compiled solver.

A wheel holds the runtime and the precompiled primitives, so that an installed Trunnion needs no compiler. The libraries require the
processor features of the build machine. With ``TRUNNION_CPU=x86_64``, the libraries run on any x86-64 processor.
``TRUNNION_PLATFORM`` names another platform by the tag of its wheels (``platform_wheels`` sets it). With ``TRUNNION_PREBUILD=0``,
and in an editable installation, there are no compiled libraries. The first use of Trunnion then compiles the libraries.

``pyproject.toml`` names these classes. setuptools loads this file by its path, before ``trunnion`` can be imported."""

from __future__ import annotations

import atexit
import importlib.util
import os
import shutil
import sys
import tempfile
from pathlib import Path

from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build import build
from setuptools.command.build_py import build_py
from setuptools.command.egg_info import egg_info
from setuptools.command.sdist import sdist

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = {"trunnion": "engine", "trunnion.fmu": "fmu", "trunnion.service": "service"}
"""{import package: its folder}, as ``package-dir`` in ``pyproject.toml``."""
GENERATED = {"__pycache__", "_built"}
CHECKOUT_ONLY = ("docs", "packaging", "key_examples", "*.md", "*.mako", "*.png")
"""Names of folders and files that no wheel holds: pages, and the code that writes pages or builds wheels."""
MODEL_FILE = "scene.yaml"
"""The only file of a bundled model that wheels hold. An installed Trunnion reads no other file of a model."""
IN_SDIST = ("engine", "fmu", "service", "tests", "models")
FILES_IN_SDIST = ("README.md", "LICENSE", "CHANGELOG.md", "CONTRIBUTING.md", "pyproject.toml")


def prebuilt() -> bool:
    """Whether wheels hold compiled libraries."""
    return os.environ.get("TRUNNION_PREBUILD") != "0"


def packages() -> list[str]:
    """Import names of all folders that wheels hold, inside the three folders of ``PACKAGES``. Folders without Python hold data."""
    found = []
    for name, folder in PACKAGES.items():
        for path in [ROOT / folder, *sorted((ROOT / folder).rglob("*"))]:
            below = path.relative_to(ROOT / folder).parts
            if path.is_dir() and not (GENERATED | {*CHECKOUT_ONLY}) & set(below) and any(f.is_file() for f in path.iterdir()):
                found.append(".".join((name, *below)))
    return found


def source_package() -> None:
    """Make this checkout importable as ``trunnion`` in the building process."""
    where = ROOT / PACKAGES["trunnion"]
    spec = importlib.util.spec_from_file_location("trunnion", where / "__init__.py", submodule_search_locations=[str(where)])
    assert spec is not None
    assert spec.loader is not None
    sys.modules["trunnion"] = module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)


def temporary(name: str) -> str:
    """A new folder outside the checkout, which is removed at the end of the building process."""
    folder = tempfile.mkdtemp(prefix=f"trunnion-{name}-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


class Build(build):
    """Builds in a temporary folder. A lasting ``build`` folder would still hold files that the checkout has deleted."""

    def initialize_options(self) -> None:
        super().initialize_options()
        self.build_base = temporary("build")


class EggInfo(egg_info):
    """Writes to a temporary folder, so that the checkout stays unchanged."""

    def initialize_options(self) -> None:
        super().initialize_options()
        self.egg_base = temporary("info")


class BuildPy(build_py):
    """Collects all packages with all files except ``CHECKOUT_ONLY``, then the bundled models and the compiled libraries."""

    def finalize_options(self) -> None:
        self.distribution.packages = packages()
        self.distribution.package_data = {"": ["*"]}
        self.distribution.exclude_package_data = {"": [*CHECKOUT_ONLY]}
        super().finalize_options()

    def find_package_modules(self, package: str, package_dir: str) -> list[tuple[str, str, str]]:
        """(package, module, file) of each module of a package that wheels hold."""
        return [m for m in super().find_package_modules(package, package_dir) if f"{m[1]}.py" not in CHECKOUT_ONLY]

    def run(self) -> None:
        super().run()
        if self.editable_mode:
            return
        target = Path(self.build_lib) / "trunnion"
        for file in (ROOT / "models").rglob(MODEL_FILE):
            folder = target / "_models" / file.parent.relative_to(ROOT / "models")
            folder.mkdir(parents=True, exist_ok=True)
            self.copy_file(file, folder)
        if prebuilt():
            build_libraries(target)


def build_libraries(target: Path) -> None:
    """Build the compiled libraries in the folder that ``trunnion.kernel.compilation.prebuilt_libraries`` reads. The cache keeps
    their object files for the next build."""
    source_package()
    from trunnion.kernel.compilation import c_compiler, prebuilt_libraries
    from trunnion.parts.primitives.library_prebuild import build as build_all

    machine = c_compiler.MACHINES[platform_tag()] if os.environ.get("TRUNNION_PLATFORM") else c_compiler.host()
    build_all(target / prebuilt_libraries.FOLDER.name / machine.level, machine=machine)


def platform_tag() -> str:
    """Platform tag of the wheel: TRUNNION_PLATFORM, or the tag of this machine."""
    source_package()
    from trunnion.kernel.compilation import c_compiler

    chosen = os.environ.get("TRUNNION_PLATFORM") or c_compiler.wheel_platform()
    if chosen not in c_compiler.MACHINES:
        raise SystemExit(f"TRUNNION_PLATFORM: {chosen!r} is not a supported platform → {', '.join(c_compiler.MACHINES)}")
    return chosen


class BdistWheel(bdist_wheel):
    """Puts the platform into the tag of a wheel that holds compiled libraries."""

    def finalize_options(self) -> None:
        self.distribution.has_ext_modules = prebuilt  # setuptools calls this function to choose between purelib and platlib
        super().finalize_options()

    def get_tag(self) -> tuple[str, str, str]:
        """(Python tag, ABI tag, platform tag). The libraries work with every Python version."""
        return "py3", "none", platform_tag() if prebuilt() else "any"


class Sdist(sdist):
    """Collects the folders and pages of the checkout."""

    def add_defaults(self) -> None:
        super().add_defaults()
        for folder in IN_SDIST:
            files = (f.relative_to(ROOT) for f in sorted((ROOT / folder).rglob("*")) if f.is_file() and f.suffix != ".pyc")
            self.filelist.extend(str(f) for f in files if not GENERATED & set(f.parts))
        self.filelist.extend(FILES_IN_SDIST)
