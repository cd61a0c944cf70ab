"""What a scene draws of a body that has solids of its own place: the largest of them, along the nearest axis of the body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Solid:
    """kind: "box" (three edges), "cylinder" (radius, length along its z) or "sphere" (radius), m; rotation: in the body (3×3)."""

    kind: str
    sizes: tuple[float, ...]
    rotation: np.ndarray

    @property
    def volume(self) -> float:
        """m³."""
        s = self.sizes
        if self.kind == "box":
            return s[0] * s[1] * s[2]
        return np.pi * s[0] ** 2 * s[1] if self.kind == "cylinder" else 4 / 3 * np.pi * s[0] ** 3


def drawn(solids: Sequence[Solid]) -> dict[str, Any]:
    """The keys of a body that draw it."""
    able = [s for s in solids if all(x > 0 for x in s.sizes)]
    if not able:
        return {}
    s = max(able, key=lambda s: s.volume)
    turned = np.abs(s.rotation)
    if s.kind == "sphere":
        return {"sphere": float(s.sizes[0])}
    if s.kind == "cylinder":
        axis = "xyz"[int(np.argmax(turned[:, 2]))]
        return {"cylinder": {"radius": float(s.sizes[0]), "length": float(s.sizes[1]), "axis": axis}}
    return {"box": [float(f"{x:.12g}") for x in turned @ np.array(s.sizes)]}
