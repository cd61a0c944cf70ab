"""The joints that carry the two shafts of a gearbox."""

from __future__ import annotations

from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes.scene import Joint, Scene
from trunnion.scene.queries.body_references import body_of


def couples_shafts(j: Joint) -> bool:
    """Whether a joint is a gearbox."""
    return REGISTRY[j.type].follows == "freedom"


def carriers(scene: Scene, shaft: str) -> list[str]:
    """Names of the joints that carry a shaft: joints with one freedom, a rotation, whose outboard part is the shaft."""
    found = []
    for name, j in scene.joints.items():
        kind = REGISTRY[j.type]
        if body_of(j.outboard) == shaft and not kind.bodiless and kind.nv == 1 and kind.turns(0):
            found.append(name)
    return found


def shaft_joints(scene: Scene, j: Joint) -> tuple[str, str]:
    """Names of the joints that carry the input and the output shaft of a gearbox; "" for a shaft that no joint, or more than one
    joint, carries."""
    a, b = (carriers(scene, body_of(side)) for side in (j.inboard, j.outboard))
    return a[0] if len(a) == 1 else "", b[0] if len(b) == 1 else ""
