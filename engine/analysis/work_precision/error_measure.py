"""The relative distance between two runs. It compares columns at sample times, in groups of one physical quantity."""

from __future__ import annotations

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.kernel.interface.output_columns import Column, columns, select
from trunnion.scene.data_classes.scene import Scene
from trunnion.system.construction.system_builder import build

NORMS = ("max", "rms")
SMALL = 1e-3
"""Least scale of a group of columns, relative to the largest group with the same unit. Without this limit, a force that is zero by
symmetry would have no scale."""


@dataclass(frozen=True)
class ErrorMeasure:
    """A distance between runs.

    Attributes:
        names: columns to compare, without time.
        groups: column indices of each quantity; the components of a vector are one group.
        units: unit of each group.
        norm: norm over time: "max" (largest distance at any sample) or "rms" (root mean square, for columns that jump).
    """

    names: tuple[str, ...]
    groups: tuple[tuple[int, ...], ...]
    units: tuple[str, ...]
    norm: str = "max"

    def scales(self, reference: np.ndarray) -> np.ndarray:
        """The largest Euclidean norm of each group over all samples, in the group's unit. reference: samples × columns."""
        peaks = np.array([np.linalg.norm(reference[:, g], axis=1).max() for g in self.groups])
        by_unit = {u: max(p for p, v in zip(peaks, self.units, strict=True) if v == u) for u in self.units}
        floors = np.array([SMALL * by_unit[u] for u in self.units])
        return np.maximum(np.maximum(peaks, floors), 1e-300)

    def each(self, data: np.ndarray, reference: np.ndarray) -> np.ndarray:
        """Relative error of every group; NaN if the numbers of samples differ."""
        if data.shape != reference.shape:
            return np.full(len(self.groups), np.nan)
        off = data - reference
        sizes = np.array([np.linalg.norm(off[:, g], axis=1) for g in self.groups])
        over = sizes.max(axis=1) if self.norm == "max" else np.sqrt((sizes**2).mean(axis=1))
        return over / self.scales(reference)

    def error(self, data: np.ndarray, reference: np.ndarray) -> float:
        """The largest relative error of all groups."""
        return float(self.each(data, reference).max())

    def describe(self) -> str:
        """The measure in words."""
        what = "largest distance" if self.norm == "max" else "root mean square distance"
        shown = ", ".join(self.names[:4]) + (f" and {len(self.names) - 4} more" if len(self.names) > 4 else "")
        return f"{what} from the reference over the sample times, relative to the largest value of the quantity; compared: {shown}"


def make_error_measure(scene: Scene, patterns: tuple[str, ...] = (), norm: str = "max") -> ErrorMeasure:
    """The measure over all columns of the scene that match the patterns. Without patterns, these are the positions of all mass
    centres."""
    system = build(scene).system
    everything = columns(system)
    wanted = patterns or tuple(f"{b.name}.position[*" for b in system.bodies)
    chosen = select(everything, wanted)
    return _group_vectors(chosen, norm)


def _group_vectors(chosen: list[Column], norm: str) -> ErrorMeasure:
    """Columns grouped by quantity: the components name[k] of a vector become one group. Columns name[k] of different contacts,
    coordinates or states remain separate groups."""
    groups: dict[str, list[int]] = {}
    units: dict[str, str] = {}
    for i, c in enumerate(chosen):
        stem = c.name.rsplit("[", 1)[0] if c.name.endswith("]") and c.quantity.vector else c.name
        groups.setdefault(stem, []).append(i)
        units[stem] = c.unit
    return ErrorMeasure(tuple(c.name for c in chosen), tuple(map(tuple, groups.values())), tuple(units.values()), norm)
