"""The numbers in a system's expressions (leaves): structural constants, which generated code contains literally, and run-time
parameters, which generated code reads from memory.

If a component of a vector or matrix is written as exactly 0, it is a structural constant, which removes terms. Every other
component, and every scalar field, is a run-time parameter. A zero whose path matches a ``tunable`` pattern is also a run-time
parameter.
"""

from __future__ import annotations

from collections.abc import Sequence

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.basics.name_patterns import matcher


@dataclass(frozen=True)
class Param:
    """A run-time parameter, by its index in the table."""

    index: int


Leaf = float | Param
Leaves = tuple[Leaf, ...]


class ParameterTable:
    """The run-time parameters, in the order of their creation: path (in the scene, if it exists there), value, unit."""

    def __init__(self, tunable: Sequence[str] = ()):
        self.paths: list[str] = []
        self.values: list[float] = []
        self.units: list[str] = []
        self._tunable = matcher(tunable)
        self._index: dict[str, int] = {}
        self._own: set[str] = set()
        self._kinks: set[int] = set()

    def scalar(self, path: str, value: float, unit: str) -> Param:
        """A run-time parameter. Two calls with the same path return the same parameter."""
        if path not in self._index:
            self._index[path] = len(self.paths)
            self.paths.append(path)
            self.values.append(float(value))
            self.units.append(unit)
        return Param(self._index[path])

    def own(self, path: str, value: float, unit: str) -> Param:
        """A run-time parameter that is the scene's number at this path. Use this function only for a number that affects nothing
        else: no scale, start value, time of a kink or other parameter."""
        self._own.add(path)
        return self.scalar(path, value, unit)

    def kink(self, path: str, value: float, unit: str) -> Param:
        """A run-time parameter that moves times at which steps must end."""
        found = self.scalar(path, value, unit)
        self._kinks.add(found.index)
        return found

    def moves_kinks(self, index: int) -> bool:
        """Whether the parameter moves times at which steps must end (``kink``)."""
        return index in self._kinks

    def place(self, path: str) -> int | None:
        """Index of the parameter that ``own`` made for this path; None if there is no such parameter."""
        return self._index[path] if path in self._own else None

    def component(self, path: str, value: float, unit: str) -> Leaf:
        """A component of a vector: a structural 0 if the value is exactly 0 and the path is not tunable, otherwise a parameter."""
        if value == 0.0 and not self._tunable(path):
            return 0.0
        return self.scalar(path, value, unit)

    def vector(self, path: str, values: Sequence[float], unit: str) -> Leaves:
        """Leaves of a vector. The paths of the components are path[1], path[2], …"""
        return tuple(self.component(f"{path}[{i + 1}]", v, unit) for i, v in enumerate(values))
