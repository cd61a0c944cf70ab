"""Joints of SDF: types, axes, devices."""

from __future__ import annotations

from typing import Any

import numpy as np

from trunnion.elements.joints import REGISTRY
from trunnion.importers.intermediate_linkage import Linkage
from trunnion.importers.pose_matrices import Pose, pose
from trunnion.importers.xml_reader import Element, Findings

TYPES = {
    "revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic", "fixed": "fixed", "ball": "spherical",
    "universal": "universal", "screw": "screw", "revolute2": "revolute",
}  # fmt: skip
"""{joint type of SDF: joint type of a scene}. A joint ``revolute2`` becomes two revolute joints in series."""


def axis_of(found: Findings, joint: Element, axis: Element | None) -> tuple[np.ndarray, str | None]:
    """(direction of an axis, name of the frame in which the direction is expressed). The name is None if the file does not name a
    frame."""
    xyz = axis.first("xyz") if axis is not None else None
    given = np.array(found.numbers(xyz, "text", xyz.text, (3,)) or [0, 0, 1.0] if xyz is not None else [0, 0, 1.0])
    if not np.any(given):
        found.add(xyz or joint, joint.get("name"), "its axis is a zero vector")
        given = np.array([0.0, 0.0, 1.0])
    return given, (xyz.get("expressed_in") or None) if xyz is not None else None


def crossed(first: Pose, second: Pose) -> Pose:
    """The frame of a universal joint: e1 along the first axis, e2 along the component of the second axis normal to e1."""
    e1, e2 = first[:3, 0], second[:3, 0]
    e2 = e2 - (e1 @ e2) * e1
    e2 = e2 / np.linalg.norm(e2)
    return pose((0.0, 0.0, 0.0), np.column_stack([e1, e2, np.cross(e1, e2)]))


def pitch_of(found: Findings, joint: Element) -> dict[str, Any]:
    """The scene key for the pitch of a screw (travel per turn, m). The result is empty for other joints."""
    if joint.get("type") != "screw":
        return {}
    if joint.first("screw_thread_pitch") is not None:
        return {"pitch": found.child(joint, "screw_thread_pitch", 1.0)}
    return {"pitch": -2 * np.pi / found.child(joint, "thread_pitch", 1.0)}


def acting(found: Findings, joint: Element, kind: str, out: Linkage) -> dict[str, Any]:
    """Scene keys for damping, friction and springs along the axes of a joint."""
    axes = [joint.first(tag) for tag in ("axis", "axis2")][: REGISTRY[kind].nv]
    dynamics = [a.first("dynamics") if a is not None else None for a in axes]

    def each(key: str) -> list[float]:
        return [found.child(d, key, 0.0) for d in dynamics]

    more: dict[str, Any] = {}
    damping, stiffness, rest = each("damping"), each("spring_stiffness"), each("spring_reference")
    if kind == "spherical":
        for a in (a for k, a in enumerate(axes) if a is not None and any((damping[k], stiffness[k], each("friction")[k]))):
            found.add(a, f"{joint.get('name')}.{a.tag}", "a ball joint has no axis for these forces", "remove its <dynamics>")
        return more
    if any(damping):
        more["damping"] = damping[0] if len(damping) == 1 else damping
    if any(stiffness):
        springs = [{"stiffness": k, "rest": r} if k else None for k, r in zip(stiffness, rest, strict=True)]
        more["spring"] = springs[0] if len(springs) == 1 else springs
    more |= out.friction(joint.get("name"), kind, sum(each("friction")))
    return more
