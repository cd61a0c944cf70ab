"""A row of the gallery: a place where methods fail."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from engine.scene import model as sm

EDGE = 1e-6
"""Relative distance from a threshold on both sides."""


@dataclass(frozen=True)
class Row:
    """title; scene at (1 + beyond) times its threshold; what is said of a scene; what it must be below and beyond."""

    number: int
    name: str
    title: str
    scene: Callable[[float], sm.Scene]
    verdict: Callable[[sm.Scene], str]
    below: str
    beyond: str
    elsewhere: str
