"""Checks of joints that follow other joints (mimic)."""

from __future__ import annotations

from collections.abc import Iterator

from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes.scene import Joint, Scene
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.findings.name_suggestions import did_you_mean
from trunnion.scene.queries.cuttable_joints import is_driven


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about joints that follow other joints."""
    for name, j in scene.joints.items():
        if j.mimic is None:
            continue
        path: Path = ("joints", name, "mimic")
        leader = scene.joints.get(j.mimic.joint)
        if leader is None:
            yield Finding((*path, "joint"), f"there is no joint {j.mimic.joint}", did_you_mean(j.mimic.joint, scene.joints))
            continue
        for who, x in ((name, j), (j.mimic.joint, leader)):
            kind = REGISTRY[x.type]
            if kind.nv != 1 or kind.nq != 1 or kind.bodiless:
                what = f"{who} is a {x.type} joint; a joint that follows or leads another joint must have one freedom"
                yield Finding(path, what, "use revolute, prismatic or screw joints")
        if is_driven(j):
            yield Finding(path, "a drive already prescribes the motion of this joint", f"drive {j.mimic.joint}, or leave mimic out")
        if _around(scene, name, j):
            yield Finding((*path, "joint"), "these joints follow each other in a circle", "let one of these joints lead all others")


def _around(scene: Scene, name: str, j: Joint | None) -> bool:
    """Whether joint j, called ``name``, follows itself through other joints."""
    seen: set[str] = set()
    while j is not None and j.mimic is not None and j.mimic.joint not in seen:
        seen.add(j.mimic.joint)
        if j.mimic.joint == name:
            return True
        j = scene.joints.get(j.mimic.joint)
    return False
