"""Meshes for drawing, read from files that a robot file names. A missing mesh is omitted with a note."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from trunnion.importers.intermediate_linkage import listed
from trunnion.importers.pose_matrices import Pose
from trunnion.importers.triangle_mesh_files import Unreadable, found, triangles
from trunnion.importers.visual_shapes import Solid
from trunnion.importers.xml_reader import Findings

LISTED = 3
"""Largest number of names in a note."""


class MeshReader:
    """Reads each mesh once and collects the names of missing meshes."""

    def __init__(self, folder: Path, findings: Findings):
        self.folder, self.findings = folder, findings
        self._known: dict[str, np.ndarray | None] = {}

    def solids(self, name: str, at: Pose, scale: Sequence[float]) -> list[Solid]:
        """The solid of a mesh for drawing; empty if the mesh cannot be read."""
        if name not in self._known:
            path = found(self.folder, name)
            try:
                self._known[name] = triangles(path) if path else None
            except Unreadable:
                self._known[name] = None
        corners = self._known[name]
        return [] if corners is None else [Solid("mesh", (), at, corners * np.array(scale))]

    def tell(self) -> None:
        """Add a note on missing meshes."""
        lost = [name for name, corners in self._known.items() if corners is None]
        if lost:
            self.findings.notes.append(f"meshes not drawn (no STL or OBJ file found): {listed(lost, LISTED)}")
