"""Rigid bodies of a scene and the ground."""

from __future__ import annotations

from dataclasses import field
from typing import Annotated

from trunnion.basics.lazy_data_classes import validated
from trunnion.basics.number_declarations import POSITIVE
from trunnion.scene.data_classes.field_types import GROUP, LIST, STRICT, AxisName, Direction, Position, Vector, either
from trunnion.scene.units.numbers_with_units import Angle, Density, Extent, Inertia, Length, Mass, Per


@validated(frozen=True, config=STRICT)
class Cylinder:
    """A solid cylinder."""

    radius: Extent
    """Radius."""
    length: Extent
    """Length along its axis."""
    axis: AxisName = "x"
    """Body axis that is parallel to the cylinder's axis."""


@validated(frozen=True, config=STRICT)
class Turn:
    """A rotation of a body about the origin of its frame. With ``angle``, the body rotates about an axis of the world. With
    ``towards``, the smallest rotation aligns an axis of the body with a direction of the world."""

    axis: Direction
    """With ``angle``, the rotation axis in the world; with ``towards``, the axis of the body that is aligned."""
    angle: Angle | None = None
    """Angle of the rotation."""
    towards: Vector | None = None
    """Direction in the world that the body's axis has after the rotation; its norm is arbitrary."""


Orientation = Annotated[
    Annotated[Turn, GROUP] | Annotated[tuple[Turn, ...], LIST], either("a turn (axis with angle or towards) or a list of turns")
]


@validated(frozen=True, config=STRICT)
class AxialInertia:
    """Inertia of a body about one axis only, such as a flywheel on a light shaft. The model includes the gyroscopic
    torque of a turning axis. A rotation about any other axis moves no inertia."""

    axial: Annotated[float, Per("kg*m^2", POSITIVE)]
    """Moment of inertia about the axis through the mass centre."""
    axis: Direction = "x"
    """The axis, in the body's frame."""


Inertias = Annotated[
    Annotated[AxialInertia, GROUP] | Annotated[tuple[Inertia, ...], LIST], either("a list of moments, or axial and axis")
]


@validated(frozen=True, config=STRICT)
class Body:
    """A rigid body. All positions and directions below are measured in its frame; a shape is centred on ``center``.

    A body with a ``position`` is placed; the ground is placed too. The points and frames of a joint between two placed parts follow
    from the poses of the parts.

    Mass properties come from a shape with ``density`` or ``mass``, or from ``mass`` and ``inertia``. If ``inertia`` is given,
    the shape is used for drawing only.
    """

    box: tuple[Extent, Extent, Extent] | None = None
    """Edges along x, y, z of a solid box."""
    cylinder: Cylinder | None = None
    """A solid cylinder."""
    sphere: Extent | None = None
    """Radius of a solid ball."""
    density: Density | None = None
    """Density of the shape."""
    mass: Mass | None = None
    """Mass, instead of a density. Mass 0 needs an ``inertia``, and is allowed if other bodies determine the motion of this body."""
    center: Position = (0.0, 0.0, 0.0)
    """Mass centre (and middle of the shape) in the body's frame."""
    inertia: Inertias | None = None
    """Inertia about the mass centre in the body's axes: (xx, yy, zz) or (xx, yy, zz, xy, xz, yz), products with their sign in the
    inertia matrix; (0, 0, 0) is a point mass. A group with ``axial`` gives inertia about one axis only."""
    points: dict[str, Position] = field(default_factory=dict)
    """Named points in the body's frame: places for joints and springs, and outputs."""
    color: str | None = None
    """Colour in pictures: a name or #rrggbb."""
    surface: str | None = None
    """Surface for drawing instead of the shape, in the body's frame, packed as ``trunnion import`` writes surfaces. The surface has
    no mass."""
    position: Position | None = None
    """Places the body: position of its frame's origin in the world when all joint coordinates are 0."""
    orientation: Orientation | None = None
    """Rotation of a placed body: one turn, or a list applied in order; default: the axes of the world."""
    start: dict[str, tuple[Length | None, Length | None, Length | None]] = field(default_factory=dict)
    """Positions of named points in the world at the start; null leaves a component open. The scene may leave start coordinates of
    joints open; these coordinates follow from the positions."""


@validated(frozen=True, config=STRICT)
class Ground:
    """The fixed world, of which only the named points matter."""

    points: dict[str, Position] = field(default_factory=dict)
    """Named points of the world."""
