"""Build backend of the project, based on setuptools. Only a wheel with compiled libraries requires the packages of the C compiler
and of the symbolic library, which take 170 MB. An editable installation has no compiled libraries."""

from __future__ import annotations

import os
import tomllib
from pathlib import Path
from typing import Any

from setuptools import build_meta
from setuptools.build_meta import (
    build_editable,
    build_sdist,
    build_wheel,
    get_requires_for_build_editable,
    get_requires_for_build_sdist,
    prepare_metadata_for_build_editable,
    prepare_metadata_for_build_wheel,
)

__all__ = [
    "build_editable",
    "build_sdist",
    "build_wheel",
    "get_requires_for_build_editable",
    "get_requires_for_build_sdist",
    "get_requires_for_build_wheel",
    "prepare_metadata_for_build_editable",
    "prepare_metadata_for_build_wheel",
]

IMPORTED = ("numpy", "platformdirs", "pydantic")
"""Packages that the build of the libraries imports. (Pydantic is needed because kinds of signals declare their keys with it.)"""


def get_requires_for_build_wheel(config_settings: Any = None) -> list[str]:
    """Packages that the build of a wheel requires: the requirements of setuptools and, unless TRUNNION_PREBUILD is 0, the packages
    that build the libraries."""
    needed = list(build_meta.get_requires_for_build_wheel(config_settings))
    if os.environ.get("TRUNNION_PREBUILD") != "0":
        project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
        needed += project["optional-dependencies"]["compile"]
        needed += [d for d in project["dependencies"] if d.startswith(IMPORTED)]
    return needed
