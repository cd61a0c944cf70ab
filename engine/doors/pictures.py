"""Meshes that a file draws its links by, from files around it; drawing goes on without those that cannot be read."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from engine.doors.placing import Pose
from engine.doors.shapes import Solid
from engine.doors.triangles import Unreadable, found, triangles
from engine.doors.xml import Findings

LISTED = 3
"""Names that a note lists."""


class Pictures:
    """Reads each mesh once, and tells which are left out."""

    def __init__(self, folder: Path, findings: Findings):
        self.folder, self.findings = folder, findings
        self._known: dict[str, np.ndarray | None] = {}

    def solids(self, name: str, at: Pose, scale: Sequence[float]) -> list[Solid]:
        """What to draw of a mesh; nothing of one that cannot be had."""
        if name not in self._known:
            path = found(self.folder, name)
            try:
                self._known[name] = triangles(path) if path else None
            except Unreadable:
                self._known[name] = None
        corners = self._known[name]
        return [] if corners is None else [Solid("mesh", (), at, corners * np.array(scale))]

    def tell(self) -> None:
        """A note of meshes that are not drawn."""
        lost = [name for name, corners in self._known.items() if corners is None]
        if lost:
            more = f" and {len(lost) - LISTED} more" if len(lost) > LISTED else ""
            self.findings.notes.append(f"meshes not drawn (no STL or OBJ there): {', '.join(lost[:LISTED])}{more}")
