"""Limits of a signal."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from trunnion.basics.lazy_data_classes import validated
from trunnion.scene.data_classes.field_types import STRICT
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.signals.declaration import SignalKind
from trunnion.scene.units.numbers_with_units import Number


@validated(frozen=True, config=STRICT)
class Limit:
    """Limits of a signal: a value beyond a limit counts as this limit. Steps end where the signal passes a limit."""

    lower: Number | None = None
    """Least value; default: no limit."""
    upper: Number | None = None
    """Largest value; default: no limit."""

    @property
    def levels(self) -> list[float]:
        """The limits that are given."""
        return [float(x) for x in (self.lower, self.upper) if x is not None]

    def of(self, value: float) -> float:
        """The limited value."""
        high = min(value, math.inf if self.upper is None else float(self.upper))
        return max(high, -math.inf if self.lower is None else float(self.lower))


def limit_findings(path: Path, limit: Limit, kind: SignalKind, data: Any) -> Iterator[Finding]:
    """Mistakes in the limits of a signal. path: path of the limits. kind, data: kind and keys of the signal."""
    if not limit.levels:
        yield Finding(path, "limits need lower, upper or both", about=((*path, "lower"), (*path, "upper")))
    if len(limit.levels) == 2 and not limit.levels[0] < limit.levels[1]:
        yield Finding((*path, "upper"), f"upper must be above lower: {limit.levels[1]:g} is not above {limit.levels[0]:g}")
    if kind.unlimited(data):
        yield Finding(path, f"{kind.unlimited(data)} cannot be limited: the times at which it passes a limit are unknown",
                      "limit a table with interpolation: linear")
