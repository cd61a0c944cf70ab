"""The curve of a cam, as a scene says it."""

from __future__ import annotations

from pydantic.dataclasses import dataclass

from engine.scene.quantities import Angle, Extent
from engine.scene.values import STRICT


@dataclass(frozen=True, config=STRICT)
class Profile:
    """The curve of a cam: how far from its axis what follows it is, by angle about the axis, as the cam sees it. A cubic spline
    goes through the values; it closes on itself where the angles go around once. Of a cam the radius is that of the path of the
    follower's point (of the middle of its roller); of a flat_cam the distance of the face at the angle of its normal."""

    angle: tuple[Angle, ...]
    """Increasing angles from e2 towards e3 of the inboard frame, three at least, over one turn at most."""
    radius: tuple[Extent, ...]
    """One distance for each angle."""
