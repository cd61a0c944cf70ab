"""What a table of the runtime says of a scene made of parts, before it is put anywhere: into memory (``memory``), or into the C
text of a model that is exported (``text``)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from engine.abi.records import Record
from engine.parts.cells import Found
from engine.parts.tables import Tables


@dataclass
class Derived:
    """A scene with its tapes, and the directions that are followed in it. beside: another one, whose constants lie behind."""

    scene: Tables
    found: Found | None = None
    beside: Derived | None = None


@dataclass
class Unit:
    """A table: its numbers, and by field the machine's functions without what begins their names, lists of integers and tables of
    records."""

    record: Record
    scene: Derived
    numbers: dict[str, int]
    functions: dict[str, str]
    integers: dict[str, Sequence[int]] = field(default_factory=dict)
    records: dict[str, tuple[Record, Sequence[tuple[Any, ...]]]] = field(default_factory=dict)
