"""The interface of reference solvers, which are other programs that solve the same scene."""

from __future__ import annotations

from abc import ABC, abstractmethod
from importlib.metadata import PackageNotFoundError, version
from typing import ClassVar

import numpy as np

from trunnion.analysis.work_precision.benchmark_model import BenchmarkModel
from trunnion.analysis.work_precision.reference_solvers.scene_snapshot import Snapshot
from trunnion.basics.lazy_data_classes import dataclass

TOLERANCES = tuple(10.0**-k for k in range(3, 12, 2))


class SceneNotSupported(Exception):
    """The program cannot represent the scene. The text gives the reason."""


@dataclass(frozen=True)
class Setting:
    """A method, either with a relative tolerance (rtol) or with a fixed step (s)."""

    method: str
    rtol: float = 0.0
    step: float = 0.0


class ReferenceSolver(ABC):
    """A program prepared for a scene. The constructor may raise SceneNotSupported. Any exception of ``run`` counts as a
    failure."""

    name: ClassVar[str]
    package: ClassVar[str]
    methods: tuple[str, ...] = ()
    """The methods to measure."""
    steps: ClassVar[tuple[int, ...]] = ()
    """Numbers of fixed steps between two sample times; () means error control with TOLERANCES."""
    all_columns: ClassVar[bool] = False
    """Whether the solver returns every column. Other solvers return only the positions of mass centres."""

    def __init__(self, ready: BenchmarkModel, scene: Snapshot):
        self.ready, self.scene = ready, scene
        self.samples = round(ready.until / ready.every)
        self.times = np.linspace(0.0, ready.until, self.samples + 1)

    @classmethod
    def version(cls) -> str:
        """Installed version; "" if the package is not installed."""
        try:
            return version(cls.package)
        except PackageNotFoundError:
            return ""

    @abstractmethod
    def describe_omissions(self) -> str:
        """The parts of the scene that this program omits, and the computations in which it differs from Trunnion."""

    def settings(self) -> list[Setting]:
        """Every method, each with decreasing steps or tolerances."""
        if self.steps:
            return [Setting(m, step=self.ready.every / n) for m in self.methods for n in self.steps]
        return [Setting(m, r) for m in self.methods for r in TOLERANCES]

    @abstractmethod
    def run(self, s: Setting) -> tuple[np.ndarray, float]:
        """Run once. Returns the compared columns at the sample times, (samples + 1) × columns, and the stepping time, s."""

    def by_position(self, positions: np.ndarray) -> np.ndarray:
        """The compared columns (samples × columns), taken from the positions of all mass centres (samples × bodies × 3), m."""
        index = {p.name: i for i, p in enumerate(self.scene.parts)}
        places = [name.partition(".position[") for name in self.ready.measure.names]
        return np.column_stack([positions[:, index[body], int(rest[:-1]) - 1] for body, _, rest in places])


def compares_only_positions(ready: BenchmarkModel, scene: Snapshot) -> bool:
    """Whether every compared column is the position of a mass centre."""
    names = {p.name for p in scene.parts}
    return all(n.partition(".position[")[0] in names and n.count(".") == 1 for n in ready.measure.names)
