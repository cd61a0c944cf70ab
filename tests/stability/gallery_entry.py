"""A row of the gallery: a place where methods fail, and the thresholds near which it is tested."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from trunnion.scene.data_classes import scene as sm

EDGE = 1e-6
"""Relative distance from a threshold on both sides."""


@dataclass(frozen=True)
class Edge:
    """A threshold of a row. at: the threshold in words, for the table; scene(x): the scene at 1 + x times the threshold; verdict:
    function of a scene; below, beyond: correct verdicts on both sides. Without ``beyond``, the row has no threshold, and the scene
    is tested once. slow: whether equivalent scenes are tested only among the slow tests."""

    at: str
    scene: Callable[[float], sm.Scene]
    verdict: Callable[[sm.Scene], str]
    below: str
    beyond: str = ""
    slow: bool = False

    @property
    def sides(self) -> tuple[tuple[float, str], ...]:
        """Pairs (distance beyond the threshold, correct verdict at this distance)."""
        return ((-EDGE, self.below), (EDGE, self.beyond)) if self.beyond else ((0.0, self.below),)


@dataclass(frozen=True)
class Row:
    """A row of the gallery. number, title: as in theory, "Where methods fail". name: name of the scene file, which holds the scene
    just beyond the first threshold. edges: the thresholds. elsewhere: failures of other programs that the table's script does not
    measure."""

    number: int
    name: str
    title: str
    edges: tuple[Edge, ...]
    elsewhere: str
