"""Notes about sliding contacts that stay on a long part by default. The user may have meant the short part, although the scene is
valid."""

from __future__ import annotations

from trunnion.elements.joints.cylindrical import CYLINDRICAL
from trunnion.elements.joints.prismatic import PRISMATIC
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.queries.body_poses_and_joint_sides import sides_of
from trunnion.scene.queries.part_extents import extent

SLIDING = (PRISMATIC.name, CYLINDRICAL.name)
SHORT = 1.5
"""A part of at most this length, in multiples of the distance between the contacts, probably carries the contacts."""


def contact_end_notes(scene: Scene) -> list[str]:
    """A note for every sliding joint whose contacts stay on a long part by default. The length of the other part is about the
    distance of the contacts. Such contacts do not move with this short part."""
    notes = []
    for name, j in scene.joints.items():
        half = j.friction.half_length if j.friction is not None else None
        if j.type not in SLIDING or j.ends is not None or not isinstance(half, float):
            continue
        carrier, other = sides_of(scene, j) if j.pin == "inboard" else sides_of(scene, j)[::-1]
        apart = 2.0 * half
        if extent(scene, carrier) > SHORT * apart >= extent(scene, other):
            key = "outboard" if j.pin == "inboard" else "inboard"
            notes.append(
                f"joints.{name}: the contacts stay at two places of {carrier.body}, {apart:g} m apart, while {other.body} slides "
                f"away. If the contacts are at the ends of {other.body}, give ends: {key}"
            )
    return notes
