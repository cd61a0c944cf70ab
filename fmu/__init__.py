"""Export of scenes as FMUs: ``trunnion.fmu.export(scene, file, flavour=…, platform=…, fmi=…)``. For FMI 2.0 there are two flavours.
The flavour ``native`` needs only libc and libm on the host. The flavour ``python`` (built with pythonfmu) calls the same compiled
library from Python code in the FMU, so both flavours give bit-identical results. For FMI 3.0 there is only the native flavour. The
equations of a scene are compiled, or (``kernel="parts"``) assembled from parts that are compiled once for all scenes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from trunnion.fmu.scene_export import Export, export

__all__ = ["Export", "export"]


def __getattr__(name: str) -> Any:
    if name in __all__:
        from importlib import import_module

        return getattr(import_module("trunnion.fmu.scene_export"), name)
    raise AttributeError(f"module 'trunnion.fmu' has no attribute {name!r}")
