"""Motions from files: columns of coordinates over time."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from engine.basics.problems import Problem, SceneError
from engine.joints import REGISTRY
from engine.scene.model import Scene
from engine.simulation.tables import load_result_table

COLUMN = re.compile(r"(?P<joint>.+)\.(q|qd|qdd)\[(?P<freedom>\d+)\]")


def read_motion(file: str, scene: Scene, only: Sequence[str] = ()) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """(times, columns of coordinates, rates and accelerations by name) of a table that a run wrote, or of any CSV file with a line
    of names. only: the joints wanted (all that have columns and freedoms that can be prescribed). SceneError for what cannot be
    used."""
    names, values = _columns(file)
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


def _columns(file: str) -> tuple[list[str], np.ndarray]:
    path = Path(file)
    try:
        read = load_result_table(path)
        return ["time", *read.names], np.column_stack([read.time, *(read[n] for n in read.names)])
    except SceneError as told:
        if path.suffix.lower() != ".csv":
            raise
        try:
            with path.open(encoding="utf-8") as lines:
                names = [n.strip() for n in next(x for x in lines if x.strip() and not x.startswith("#")).split(",")]
            return names, np.atleast_2d(np.loadtxt(path, delimiter=",", skiprows=_head(path), comments="#"))
        except (OSError, ValueError, StopIteration) as e:
            raise SceneError([Problem("--motion", f"cannot read {file!r}: {e}", "a CSV file: names first, then numbers")]) from told


def _head(path: Path) -> int:
    """Lines up to and with that of the names."""
    with path.open(encoding="utf-8") as lines:
        return 1 + next(i for i, x in enumerate(lines) if x.strip() and not x.startswith("#"))
