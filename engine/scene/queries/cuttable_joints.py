"""Which joints a loop may be opened at."""

from __future__ import annotations

from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes.scene import Joint, Scene


def is_driven(j: Joint) -> bool:
    """Whether any freedom of a joint is prescribed."""
    return any(d is not None for d in (j.drive if isinstance(j.drive, tuple) else (j.drive,)))


def has_rotor(j: Joint) -> bool:
    """Whether the motion of a joint turns an inertia of its own."""
    return j.rotor_inertia is not None


def tied(scene: Scene) -> set[str]:
    """Joints whose freedom follows another's, and those that lead."""
    pairs = [(name, j.mimic.joint) for name, j in scene.joints.items() if j.mimic is not None]
    return {name for pair in pairs for name in pair}


def may_be_cut(j: Joint) -> bool:
    """Whether the rows of a cut joint, (46) and (49), express all that this one does: no row says what a drive prescribes, nor that
    accelerations along a freedom take a force. Of joints that others follow see ``tied``."""
    return REGISTRY[j.type].cuttable and not is_driven(j) and not has_rotor(j)
