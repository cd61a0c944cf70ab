"""What a chart asks of another program: the interface every peer implements."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import ClassVar

import numpy as np

from engine.chart.peers.snapshot import Snapshot
from engine.chart.runs import Prepared

TOLERANCES = tuple(10.0**-k for k in range(3, 12, 2))
STEPS_A_SAMPLE = (1, 3, 10, 30, 100, 300, 1000)
"""Fixed steps between two sample times."""


class Unable(Exception):
    """The program cannot represent the scene; the text says why."""


@dataclass(frozen=True)
class Setting:
    """A method with a tolerance or a fixed step (s)."""

    method: str
    rtol: float = 0.0
    step: float = 0.0


class Peer(ABC):
    """A program made ready for a scene. The constructor raises Unable; ``run`` may raise anything, which becomes a failure."""

    name: ClassVar[str]
    package: ClassVar[str]
    all_columns: ClassVar[bool] = False
    """Whether the peer gives every column; otherwise it gives positions of mass centres only."""

    def __init__(self, ready: Prepared, scene: Snapshot):
        self.ready, self.scene = ready, scene
        self.samples = round(ready.until / ready.every)
        self.times = np.linspace(0.0, ready.until, self.samples + 1)

    @classmethod
    def version(cls) -> str:
        """Installed version, "" when it is not installed."""
        try:
            return version(cls.package)
        except PackageNotFoundError:
            return ""

    @abstractmethod
    def leaves_out(self) -> str:
        """What of the scene it does not model, or how it differs."""

    @abstractmethod
    def settings(self) -> list[Setting]:
        """The methods with their tolerances or steps that are to be measured."""

    @abstractmethod
    def run(self, s: Setting) -> tuple[np.ndarray, float]:
        """Run once: (compared columns at the sample times, samples+1 × columns; seconds of stepping alone)."""

    def by_position(self, positions: np.ndarray) -> np.ndarray:
        """Compared columns from positions of all mass centres (samples × bodies × 3)."""
        index = {p.name: i for i, p in enumerate(self.scene.parts)}
        out = []
        for name in self.ready.measure.names:
            body, _, rest = name.partition(".position[")
            out.append(positions[:, index[body], int(rest[:-1]) - 1])
        return np.column_stack(out)


def only_positions(ready: Prepared, scene: Snapshot) -> bool:
    """Whether everything compared is the position of a mass centre."""
    names = {p.name for p in scene.parts}
    return all(n.partition(".position[")[0] in names and n.count(".") == 1 for n in ready.measure.names)
