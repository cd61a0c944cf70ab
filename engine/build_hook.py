"""What is built with a wheel: the runtime, and the parts of all scenes, so that an installed Trunnion starts at once, without a
compiler.

A wheel is for processors of the level of the machine that builds it; TRUNNION_CPU=x86_64 builds one for all of them, to be passed
on. TRUNNION_PREBUILD=0 builds none of this, as an editable installation does: then all is built on first use."""

from __future__ import annotations

import os
import sys
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class Libraries(BuildHookInterface):
    """Puts libraries into a wheel (``parts.building``). They are kept in the cache of kernels: the same sources are built once."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build, and tell hatchling what goes where. version: "editable", or the usual one."""
        if version == "editable" or os.environ.get("TRUNNION_PREBUILD") == "0":
            return
        sys.path.insert(0, self.root)
        from engine.kernel import built, cache
        from engine.kernel.compiler import wheel_platform
        from engine.parts.building import build
        from engine.parts.store import toolchain

        folder, _ = cache.entry(f"built-{cache.digest(built.sources(), *toolchain())}", build)
        for file in folder.iterdir():
            build_data["force_include"][str(file)] = f"engine/{built.FOLDER.name}/{built.level()}/{file.name}"
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-{wheel_platform()}"
