"""What is compared between runs: columns at sample times, in groups of equal meaning, and the relative distance between two."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from engine.kernel.columns import Column, columns, select
from engine.scene.model import Scene
from engine.system.build import build

NORMS = ("max", "rms")
SMALL = 1e-3
"""A group that stays below this part of the largest group of its unit is compared with that part (a force that is zero by symmetry
has no relative error of its own)."""


@dataclass(frozen=True)
class Measure:
    """Columns to compare (``names``, without time), their groups (a vector is one group), units, the norm over time:
    max: largest distance at any sample; rms: root mean square over the samples (for columns that jump at events)."""

    names: tuple[str, ...]
    groups: tuple[tuple[int, ...], ...]
    units: tuple[str, ...]
    norm: str = "max"

    def scales(self, reference: np.ndarray) -> np.ndarray:
        """Largest length of each group over time; reference: samples × columns."""
        peaks = np.array([np.linalg.norm(reference[:, g], axis=1).max() for g in self.groups])
        by_unit = {u: max(p for p, v in zip(peaks, self.units, strict=True) if v == u) for u in self.units}
        floors = np.array([SMALL * by_unit[u] for u in self.units])
        return np.maximum(np.maximum(peaks, floors), 1e-300)

    def each(self, data: np.ndarray, reference: np.ndarray) -> np.ndarray:
        """Relative error of every group; NaN where the samples differ in number."""
        if data.shape != reference.shape:
            return np.full(len(self.groups), np.nan)
        off = data - reference
        sizes = np.array([np.linalg.norm(off[:, g], axis=1) for g in self.groups])
        over = sizes.max(axis=1) if self.norm == "max" else np.sqrt((sizes**2).mean(axis=1))
        return over / self.scales(reference)

    def error(self, data: np.ndarray, reference: np.ndarray) -> float:
        """Relative error of the group where it is largest."""
        return float(self.each(data, reference).max())

    def describe(self) -> str:
        """The measure in words, for notes beside the numbers."""
        what = "largest distance" if self.norm == "max" else "root mean square distance"
        shown = ", ".join(self.names[:4]) + (f" and {len(self.names) - 4} more" if len(self.names) > 4 else "")
        return f"{what} from the reference over the sample times, relative to the largest value of the quantity; compared: {shown}"


def measure(scene: Scene, patterns: tuple[str, ...] = (), norm: str = "max") -> Measure:
    """The measure over all columns of the scene that match the patterns (default: positions of all mass centres)."""
    system = build(scene).system
    everything = columns(system)
    wanted = patterns or tuple(f"{b.name}.position[*" for b in system.bodies)
    chosen = select(everything, wanted)
    return _grouped(chosen, norm)


def _grouped(chosen: list[Column], norm: str) -> Measure:
    """Vectors (name[k]) become one group each, unless k counts contacts, coordinates or states."""
    groups: dict[str, list[int]] = {}
    units: dict[str, str] = {}
    for i, c in enumerate(chosen):
        stem = c.name.rsplit("[", 1)[0] if c.name.endswith("]") and c.quantity.vector else c.name
        groups.setdefault(stem, []).append(i)
        units[stem] = c.unit
    return Measure(tuple(c.name for c in chosen), tuple(map(tuple, groups.values())), tuple(units.values()), norm)
