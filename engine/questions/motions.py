"""Motions from files: columns of coordinates over time."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from engine.basics.problems import Problem, SceneError
from engine.joints import REGISTRY
from engine.scene.model import Scene
from engine.simulation.measured_tables import columns_of

COLUMN = re.compile(r"(?P<joint>.+)\.(q|qd|qdd)\[(?P<freedom>\d+)\]")


def read_motion(file: str, scene: Scene, only: Sequence[str] = ()) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """(times, columns of coordinates, rates and accelerations by name) of a table that a run wrote, or of any CSV file with a line
    of names. only: the joints wanted (all that have columns and freedoms that can be prescribed). SceneError for what cannot be
    used."""
    names, values = columns_of(file, "--motion")
    if "time" not in names:
        raise SceneError([Problem("--motion", f"{file!r} has no column time", f"it has {', '.join(names[:6])}")])
    if wrong := [n for n in only if not any(c.startswith(f"{n}.q[") for c in names)]:
        raise SceneError([Problem("--drive", f"{file!r} has no column {n}.q[…]", "name a joint of the file") for n in wrong])
    motion = {}
    for i, name in enumerate(names):
        match = COLUMN.fullmatch(name)
        joint = scene.joints.get(match["joint"]) if match else None
        if match is None or joint is None or (only and match["joint"] not in only):
            continue
        kind, k = REGISTRY[joint.type], int(match["freedom"]) - 1
        if 0 <= k < kind.nv and kind.coordinate_of(k) >= 0:
            motion[name] = values[:, i]
    return values[:, names.index("time")], motion
