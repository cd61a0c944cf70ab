"""A scene in which every joint side gives its own point and axes. The sides of joints between placed bodies follow from the bodies'
poses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.reference.mechanics.bodies_and_joint_frames import GROUND, direction, named_point, place
from tests.reference.mechanics.rotation import turned
from trunnion.scene.data_classes import scene as sm

APART = ("gear", "bevel_gear", "rack", "belt", "cam", "flat_cam", "point_on_curve", "rod", "worm", "gearbox")
"""Types whose two points do not coincide."""


def pose(scene, body: str) -> tuple[np.ndarray, np.ndarray] | None:
    """Origin and axes of a placed body or of the ground; None for a body without a position."""
    if body == GROUND:
        return np.zeros(3), np.eye(3)
    b = scene.bodies[body]
    if b.position is None:
        return None
    R = np.eye(3)
    for turn in b.orientation if isinstance(b.orientation, tuple) else (b.orientation,) if b.orientation else ():
        axis = direction(turn.axis)
        if turn.towards is None:
            R = turned(R, axis * turn.angle)
            continue
        now, goal = R @ axis, direction(turn.towards)
        across = np.cross(now, goal)
        sine = np.linalg.norm(across)
        if sine == 0.0:
            across = np.cross(now, np.eye(3)[int(np.argmin(np.abs(now)))]) if now @ goal < 0 else np.zeros(3)
            sine = np.linalg.norm(across) or 1.0
        R = turned(R, across / sine * np.arctan2(np.linalg.norm(np.cross(now, goal)), now @ goal))
    return np.array(b.position, float), R


def _named(side) -> tuple[str, bool]:
    if isinstance(side, str):
        return side.partition(".")[0], "." in side
    return side.body, True


def _spot(scene, joint, poses) -> np.ndarray:
    """The joint's place in the world."""
    if joint.at is not None and not isinstance(joint.at, str):
        return np.array(joint.at, float)
    for side, (origin, R) in zip((joint.inboard, joint.outboard), poses, strict=True):
        text = joint.at or side
        if isinstance(text, str):
            body, local = place(scene, text)
            if joint.at is not None:
                origin, R = pose(scene, body)
            if local is not None:
                return origin + R @ local
        else:
            return origin + R @ named_point(scene, side.body, side.point)
    return poses[0][0] if _named(joint.outboard)[0] == GROUND else poses[1][0]


def _common(joint) -> tuple[np.ndarray, np.ndarray]:
    if joint.axis is None:
        return np.eye(3)[0], np.eye(3)[1]
    axis = direction(joint.axis)
    after = np.eye(3)[(int(np.argmax(np.abs(axis))) + 1) % 3]
    return axis, after if joint.reference is None else direction(joint.reference)


def resolved(scene: sm.Scene) -> sm.Scene:
    """The scene in which both sides of every joint between placed parts are written out."""
    return replace(scene, joints={n: _resolved(scene, j) for n, j in scene.joints.items()})


def _resolved(scene, joint):
    poses = tuple(pose(scene, _named(s)[0]) for s in (joint.inboard, joint.outboard))
    if None in poses:
        return joint
    spot = None if joint.type in APART else _spot(scene, joint, poses)
    axis, reference = _common(joint)
    sides = []
    for side, (origin, R) in zip((joint.inboard, joint.outboard), poses, strict=True):
        body, has = _named(side)
        own = side if isinstance(side, sm.Side) else None
        if isinstance(side, str) and has:
            point = place(scene, side)[1]
        elif own is not None:
            point = named_point(scene, own.body, own.point)
        else:
            point = np.zeros(3) if spot is None else R.T @ (spot - origin)
        own_axis = own.axis if own is not None and own.axis is not None else tuple(map(float, R.T @ axis))
        own_reference = own.reference if own is not None and own.reference is not None else tuple(map(float, R.T @ reference))
        if own is not None and own.axis is not None and own.reference is None and joint.reference is None:
            own_reference = None
        sides.append(sm.Side(body, tuple(map(float, point)), own_axis, own_reference))
    joint = replace(joint, inboard=sides[0], outboard=sides[1], axis=None, reference=None, at=None)
    if joint.type != "rod" or joint.length is not None:
        return joint
    ends = [origin + R @ np.array(side.point) for side, (origin, R) in zip(sides, poses, strict=True)]
    return replace(joint, length=float(np.linalg.norm(ends[1] - ends[0])))
