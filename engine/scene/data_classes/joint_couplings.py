"""Data of joints that couple the motion of other joints: the profile of a cam, the curve of a slot, the ratio of a mimic joint."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from trunnion.basics.lazy_data_classes import validated
from trunnion.basics.number_declarations import Bound
from trunnion.scene.data_classes.field_types import STRICT, Before, Exactly
from trunnion.scene.units.numbers_with_units import Angle, AnyUnit, Extent, Length, Number
from trunnion.scene.units.unit_parser import UnitError


@validated(frozen=True, config=STRICT)
class Profile:
    """The profile of a cam: the follower's distance from the cam axis as a cubic spline over the angle, seen from the cam. The
    spline is periodic if the angles cover a full turn. For a cam, the distance of the follower's point (the centre of its roller)
    is given. For a flat_cam, the distance of the face at the angle of the face's normal is given."""

    angle: tuple[Angle, ...]
    """At least three increasing angles, from e2 towards e3 of the inboard frame; they cover one turn at most."""
    radius: tuple[Extent, ...]
    """One distance for each angle."""


def _planar(point: Any) -> Any:
    """The point unchanged. Raises UnitError with an explanation when the point has three coordinates."""
    if isinstance(point, list | tuple) and len(point) == 3:
        hint = "give two numbers, along e2 and e3 (axis: e1); for a straight line in space there is point_on_line"
        raise UnitError("a curve lies in the plane normal to e1 of its joint; curves in space are not supported", hint)
    return point


@validated(frozen=True, config=STRICT)
class Curve:
    """A curve in a plane of the inboard part: the cubic spline through points, parametrised by chord length. The curve must not
    cross itself. Two points give a straight slot. Beyond its ends an open curve continues straight; end stops act at the ends."""

    points: tuple[Annotated[tuple[Length, Length], Before(_planar)], ...]
    """Coordinates along e2 and e3 of the inboard frame, relative to the inboard point. At least two points; a closed curve
    needs three."""
    closed: Annotated[bool, Exactly()] = False
    """Whether the curve continues from the last point to the first."""


@validated(frozen=True, config=STRICT)
class Slot:
    """Walls of a slot along a curve. The walls touch the pin where its centre is at the distance ``play`` from the curve. Around
    each end of an open curve the walls join in a half circle, unless the end is a mouth."""

    play: Extent
    """Largest distance of the pin's centre from the curve: half of (width of the slot − diameter of the pin)."""
    mouth: Literal["start", "end", "both"] | None = None
    """Ends of the curve at which the slot is open, so that the pin leaves and enters. Default: none."""
    repeated: Annotated[int, Exactly()] = 1
    """Number of equal slots, evenly around e1 at the inboard point. The curve describes the slot around e2."""


@validated(frozen=True, config=STRICT)
class Mimic:
    """A constraint between two joints with one freedom each: q = ratio · (q of the leading joint) + offset."""

    joint: str
    """Name of the leading joint."""
    ratio: Annotated[float, AnyUnit(bound=Bound(nonzero=True))] = 1.0
    """Change of this joint's coordinate for a unit change of the leading joint's coordinate: a number, m/rad or rad/m."""
    offset: Number = 0.0
    """Coordinate of this joint when the leading joint's coordinate is 0."""
