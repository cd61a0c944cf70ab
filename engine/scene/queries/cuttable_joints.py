"""The joints at which a loop may be opened."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes.scene import Joint, Scene
from trunnion.scene.queries.shaft_joints import couples_shafts, shaft_joints


def is_driven(j: Joint) -> bool:
    """Whether a drive prescribes any freedom of a joint."""
    return any(d is not None for d in (j.drive if isinstance(j.drive, tuple) else (j.drive,)))


def has_rotor(j: Joint) -> bool:
    """Whether a joint has rotor inertia."""
    return j.rotor_inertia is not None


def tied(scene: Scene) -> set[str]:
    """Names of the joints with a mimic, of their leading joints, and of the joints of shafts that a gearbox couples."""
    pairs = [(name, j.mimic.joint) for name, j in scene.joints.items() if j.mimic is not None]
    pairs += [shaft_joints(scene, j) for j in scene.joints.values() if couples_shafts(j)]
    return {name for pair in pairs for name in pair}


def may_be_cut(j: Joint) -> bool:
    """Whether the constraint rows of a cut joint, (46) and (49), can represent this joint. These rows represent neither a drive nor
    rotor inertia. ``tied`` gives further joints that may not be cut."""
    return REGISTRY[j.type].cuttable and not is_driven(j) and not has_rotor(j)


def with_cuts(scene: Scene, wishes: Mapping[str, bool | None]) -> Scene:
    """The scene with the key ``cut`` of every joint that may be cut as in ``wishes``, {joint: value}. Other joints have no key
    ``cut``."""
    never = tied(scene)
    cuts = {n: wishes[n] if may_be_cut(j) and n not in never else None for n, j in scene.joints.items()}
    return replace(scene, joints={n: replace(j, cut=cuts[n]) for n, j in scene.joints.items()})
