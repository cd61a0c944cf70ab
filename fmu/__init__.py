"""Scenes as co-simulation FMUs: ``fmu.export(scene, file, flavour=…, platform=…, fmi=…)``. FMI 2.0 in two flavours, or 3.0.

``native`` needs nothing on the host but libc and libm; ``python`` (built with pythonfmu) runs the same compiled library from a
Python slave. Same variables, same numbers, bit for bit. The scene is compiled, or (``kernel="parts"``) made of parts, which are
compiled once for all scenes of the same kinds.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fmu.export import Export, export

__all__ = ["Export", "export"]


def __getattr__(name: str) -> Any:
    if name in __all__:
        from importlib import import_module

        return getattr(import_module("fmu.export"), name)
    raise AttributeError(f"module 'fmu' has no attribute {name!r}")
