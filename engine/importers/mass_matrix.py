"""Mass matrix of a linkage in its initial pose, from the Jacobians of all links."""

from __future__ import annotations

import numpy as np

from trunnion.elements.joints import REGISTRY
from trunnion.importers.intermediate_linkage import GROUND, Linkage
from trunnion.importers.pose_matrices import Pose


def mass_matrix(linkage: Linkage, world: dict[str, Pose]) -> tuple[list[tuple[str, int]], np.ndarray]:
    """(list with (joint, freedom) of each row, mass matrix with rotor inertias) of the linkage's tree in its initial pose.
    ``world`` holds the poses of the links. If several joints carry a link, the tree contains the first of them."""
    rows: list[tuple[str, int]] = []
    columns: dict[str, list[tuple[int, bool, np.ndarray, np.ndarray]]] = {GROUND: []}
    rotors: list[float] = []
    for name, t in linkage.joints.items():
        if t.outboard in columns or t.inboard not in columns:
            continue
        at = world[t.outboard] @ t.at_out
        own = []
        for k, axes in enumerate(REGISTRY[t.kind].axes):
            own.append((len(rows), axes[0].rot, at[:3, axes[0].index], at[:3, 3]))
            rows.append((name, k))
            given = t.more.get("rotor_inertia", 0.0)
            rotors.append(given[k] if isinstance(given, list) else given)
        columns[t.outboard] = columns[t.inboard] + own
    M = np.diag(np.array(rotors, float))
    for name, link in linkage.links.items():
        R = world[name][:3, :3]
        center, moved, turned = world[name][:3, 3] + R @ link.center, np.zeros((3, len(rows))), np.zeros((3, len(rows)))
        for i, turns, axis, point in columns.get(name, []):
            moved[:, i] = np.cross(axis, center - point) if turns else axis
            turned[:, i] = axis if turns else 0.0
        M += link.mass * moved.T @ moved + turned.T @ (R @ link.inertia @ R.T) @ turned
    return rows, M
