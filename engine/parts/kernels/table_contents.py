"""Contents of a kernel's table. ``tables_in_memory`` writes the contents into memory, ``tables_as_c`` as C text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from typing import Any

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.parts.derivatives.tangent_layout import TangentTables
from trunnion.parts.layout.scene_tables import SceneTables
from trunnion.runtime.abi.record_definition import Record


@dataclass
class DifferentiatedScene:
    """A scene with its programs and tangents. beside: another scene, whose constants follow those of the first scene."""

    scene: SceneTables
    tangents: TangentTables | None = None
    beside: DifferentiatedScene | None = None


@dataclass
class UnitDescription:
    """The fields of a table: numbers, functions (C names without ``tr_parts_``), lists of integers, tables of records."""

    record: Record
    scene: DifferentiatedScene
    numbers: dict[str, int]
    functions: dict[str, str]
    integers: dict[str, Sequence[int]] = field(default_factory=dict)
    records: dict[str, tuple[Record, Sequence[tuple[Any, ...]]]] = field(default_factory=dict)
