"""What ties parts that other joints carry, as a scene says it: the curve of a cam, a curve that a point stays on, a joint
that follows another."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Strict
from pydantic.dataclasses import dataclass

from trunnion.basics.number_declarations import Bound
from trunnion.scene.data_classes.field_types import STRICT
from trunnion.scene.units.quantities import Angle, AnyUnit, Extent, Length, Number
from trunnion.scene.units.unit_parser import UnitError


@dataclass(frozen=True, config=STRICT)
class Profile:
    """The curve of a cam: how far from its axis what follows it is, by angle about the axis, as the cam sees it. A cubic spline
    goes through the values; it closes on itself where the angles go around once. Of a cam the radius is that of the path of the
    follower's point (of the middle of its roller); of a flat_cam the distance of the face at the angle of its normal."""

    angle: tuple[Angle, ...]
    """Increasing angles from e2 towards e3 of the inboard frame, three at least, over one turn at most."""
    radius: tuple[Extent, ...]
    """One distance for each angle."""


def _planar(point: Any) -> Any:
    """The point as it is; one with three numbers is told what curves are."""
    if isinstance(point, list | tuple) and len(point) == 3:
        hint = "give two numbers, along e2 and e3 (axis: e1); for a straight line in space there is point_on_line"
        raise UnitError("a curve lies in the plane across e1 of its joint: curves in space are not built", hint)
    return point


@dataclass(frozen=True, config=STRICT)
class Curve:
    """A curve in a plane of the inboard part: the cubic spline through points, by the lengths of the straight lines between them.
    It may not cross itself. Two points are a straight slot; an open curve goes straight on beyond its ends (stops hold there)."""

    points: tuple[Annotated[tuple[Length, Length], BeforeValidator(_planar)], ...]
    """Points along e2 and e3 of the inboard frame, from the inboard point: two at least, of a closed curve three."""
    closed: Annotated[bool, Strict()] = False
    """Whether it goes on from the last point to the first."""


@dataclass(frozen=True, config=STRICT)
class Mimic:
    """The freedom of a joint follows that of another: q = ratio · q of the other + offset, whatever force that takes."""

    joint: str
    """Name of the joint that leads."""
    ratio: Annotated[float, AnyUnit(bound=Bound(nonzero=True))] = 1.0
    """How far this one goes for each of the other: a number, m/rad or rad/m."""
    offset: Number = 0.0
    """Coordinate of this one where the other is at 0."""
