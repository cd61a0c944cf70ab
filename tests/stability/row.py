"""A row of the gallery: a place where methods fail, and the thresholds at which it is looked at."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from engine.scene import model as sm

EDGE = 1e-6
"""Relative distance from a threshold on both sides."""


@dataclass(frozen=True)
class Edge:
    """at: the threshold in words (for the table); scene at (1 + beyond) times it; what is asked of a scene; what must be said below
    and beyond. Without ``beyond`` there is no threshold and the scene is asked once."""

    at: str
    scene: Callable[[float], sm.Scene]
    verdict: Callable[[sm.Scene], str]
    below: str
    beyond: str = ""

    @property
    def sides(self) -> tuple[tuple[float, str], ...]:
        """(beyond, what must be said)."""
        return ((-EDGE, self.below), (EDGE, self.beyond)) if self.beyond else ((0.0, self.below),)


@dataclass(frozen=True)
class Row:
    """number and title as in the method's list; name of its scene; thresholds, the first of which is the scene's file, just beyond;
    what goes wrong elsewhere, when it is not measured."""

    number: int
    name: str
    title: str
    edges: tuple[Edge, ...]
    elsewhere: str
