"""Checks of placed bodies: valid turns, coinciding joint points, and keys that require placed bodies."""

from __future__ import annotations

import math
from collections.abc import Iterator

from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.queries.body_poses_and_joint_sides import has_own_point, place_of, pose_of, poses_of, turns, vector
from trunnion.scene.queries.body_references import body_of, is_known, point_of, split

APART = 1e-6
"""Largest accepted distance between the two points of a joint, relative to the extent of the placed bodies."""


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about placed bodies and their joints."""
    for name, b in scene.bodies.items():
        path: Path = ("bodies", name, "orientation")
        if b.orientation is not None and b.position is None:
            yield Finding(path, "an orientation needs a position", "add position: [0, 0, 0]")
        for i, t in enumerate(turns(b)):
            at = (*path, i) if isinstance(b.orientation, tuple) else path
            if (t.angle is None) == (t.towards is None):
                said = "neither angle nor towards" if t.angle is None else "both angle and towards"
                yield Finding(at, f"a turn has {said}", "give one of them")
            if not any(vector(t.axis)) or (t.towards is not None and not any(vector(t.towards))):
                yield Finding(at, "a direction of zero length", "give x, y, z or three numbers that are not all zero")
    if all(not list(_turned_wrong(scene, n)) for n in scene.bodies):
        yield from _joints(scene)


def _turned_wrong(scene: Scene, name: str) -> Iterator[bool]:
    for t in turns(scene.bodies[name]):
        if (t.angle is None) == (t.towards is None) or not any(vector(t.axis)):
            yield True


def _joints(scene: Scene) -> Iterator[Finding]:
    size = max([math.dist(b.position, (0.0, 0.0, 0.0)) for b in scene.bodies.values() if b.position is not None] or [0.0])
    for name, j in scene.joints.items():
        path: Path = ("joints", name)
        parts = (j.inboard, j.outboard)
        known = all(is_known(scene, s) for s in parts)
        if j.at is not None:
            named = [split(j.at)[0]] if isinstance(j.at, str) else []
            loose = [b for b in dict.fromkeys([*map(body_of, parts), *named]) if b in scene.bodies and pose_of(scene, b) is None]
            if loose:
                hint = f"add position to {' and '.join(loose)}, or name points of both bodies"
                yield Finding((*path, "at"), f"`at` needs bodies with a position; there is none for {' and '.join(loose)}", hint)
        poses = poses_of(scene, j) if known else None
        two = REGISTRY[j.type].apart
        if two and j.at is not None:
            what = f"the two parts of a {j.type} do not meet in one place"
            yield Finding((*path, "at"), what, "remove at; name a point of each body instead (default: the origin of its frame)")
        if poses is None or two or (isinstance(j.at, str) and not is_known(scene, j.at)):
            continue
        spot = place_of(scene, j, poses)
        for key, side, pose in zip(("inboard", "outboard"), parts, poses, strict=True):
            apart = math.dist(pose.world(point_of(scene, side)[1]), spot) if has_own_point(side) else 0.0
            if apart > APART * max(size, math.dist(spot, (0.0, 0.0, 0.0))):
                hint = "name only one of the two points (the other follows), or place the bodies so that the points coincide"
                yield Finding((*path, key), f"with the bodies placed as they are, the point is {apart:.3g} m from the joint", hint)
