"""Lengths of rods."""

from __future__ import annotations

import math

from trunnion.scene.data_classes.scene import Joint, Scene
from trunnion.scene.queries.body_poses_and_joint_sides import poses_of
from trunnion.scene.queries.body_references import point_of


def rod_length(scene: Scene, j: Joint) -> float | None:
    """Length of a rod, m: its key ``length``, else the distance of its points in the poses of the placed bodies. None if neither
    exists."""
    if j.length is not None:
        return float(j.length)
    poses = poses_of(scene, j)
    if poses is None:
        return None
    a, b = (pose.world(point_of(scene, side)[1]) for side, pose in zip((j.inboard, j.outboard), poses, strict=True))
    return math.dist(a, b)
