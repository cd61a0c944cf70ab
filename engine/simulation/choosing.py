"""Which kernel evaluates a scene where nobody says: by its structure alone, so that the same scene gives the same bits, in a batch
as by itself, whatever is cached."""

from __future__ import annotations

from engine.system.structure import System

MANY = 14
"""Multipliers of friction on a tree. Compiled maps take time and code that grow with their square (22 s to compile for 16 pins);
along the recursion a step costs the same for each body, less than compiled from here on (``tests/benchmarks/parts.py``)."""


def kernel_of(system: System) -> tuple[str, str]:
    """(kind of kernel, why) for a structure."""
    if not system.cuts and system.neta >= MANY:
        return "parts", f"a tree with {system.neta} frictions"
    if system.cuts:
        return "compiled", "it has loops"
    return "compiled", f"a tree with {system.neta} frictions, fewer than {MANY}" if system.neta else "nothing rubs"
