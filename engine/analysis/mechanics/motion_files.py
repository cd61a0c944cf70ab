"""Reads motions from files: columns of coordinates over time."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from trunnion.basics.errors import Problem, SceneError
from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes.scene import Scene
from trunnion.simulation.results.user_table_reader import read_user_table
from trunnion.system.construction.spanning_tree import closing_joints

COLUMN = re.compile(r"(?P<joint>.+)\.(q|qd|qdd)\[(?P<freedom>\d+)\]")


def read_motion(file: str, scene: Scene, only: Sequence[str] = ()) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Read a motion from a result table, or from a CSV file with column names. Returns the times (n), s, and the coordinates,
    rates and accelerations (n) by column name.

    only: joints to read; default: all joints with columns of freedoms that can be prescribed. In a loop, one joint is left out; its
    motion follows from the loop. Raises SceneError for an unusable file. """
    names, values = read_user_table(file, "--motion")
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
        if kind.can_be_prescribed(k):
            motion[name] = values[:, i]
    if not only:
        closing = closing_joints(scene, {n.rpartition(".")[0] for n in motion})
        motion = {n: column for n, column in motion.items() if n.rpartition(".")[0] not in closing}
    return values[:, names.index("time")], motion
