"""Questions about sliding contacts whose ends lie on the longer part. They are never mistakes."""

from __future__ import annotations

import math

from trunnion.elements.joints.cylindrical import CYLINDRICAL
from trunnion.elements.joints.prismatic import PRISMATIC
from trunnion.scene.data_classes.scene import Body, Scene
from trunnion.scene.queries.body_poses import JointSide, sides_of, vector
from trunnion.scene.queries.body_references import GROUND

SLIDING = (PRISMATIC.name, CYLINDRICAL.name)
SHORT = 1.5
"""× the distance between the contacts: a part that is not longer probably carries them."""


def contact_end_notes(scene: Scene) -> list[str]:
    """A note for every sliding joint whose contacts stay on a long part by default, although the other part is about as long as the
    distance between the contacts. Such contacts do not move with the short part."""
    notes = []
    for name, j in scene.joints.items():
        half = j.friction.half_length if j.friction is not None else None
        if j.type not in SLIDING or j.ends is not None or not isinstance(half, float):
            continue
        carrier, other = sides_of(scene, j) if j.pin == "inboard" else sides_of(scene, j)[::-1]
        apart = 2.0 * half
        if _extent(scene, carrier) > SHORT * apart >= _extent(scene, other):
            key = "outboard" if j.pin == "inboard" else "inboard"
            notes.append(
                f"joints.{name}: the contacts stay at two places of {carrier.body}, {apart:g} m apart, while {other.body} slides "
                f"away. Are they at the ends of {other.body}? Then give ends: {key}"
            )
    return notes


def _extent(scene: Scene, side: JointSide) -> float:
    """Length of a part along the joint's axis, m; infinite for the ground and for a part without a shape."""
    if side.body == GROUND or side.axis is None:
        return math.inf
    return _length(scene.bodies[side.body], vector(side.axis))


def _length(b: Body, axis: tuple[float, float, float]) -> float:
    """Length of a body's shape along an axis, m; infinite without a shape."""
    size = math.hypot(*axis)
    if b.box is not None:
        return sum(abs(a) * float(e) for a, e in zip(axis, b.box, strict=True)) / size
    if b.cylinder is not None:
        along = abs(axis["xyz".index(b.cylinder.axis[-1])]) / size
        return along * float(b.cylinder.length) + 2.0 * math.sqrt(max(0.0, 1.0 - along**2)) * float(b.cylinder.radius)
    return math.inf if b.sphere is None else 2.0 * float(b.sphere)
