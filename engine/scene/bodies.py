"""Rigid bodies of a scene and the ground."""

from __future__ import annotations

from dataclasses import field

from pydantic.dataclasses import dataclass

from engine.scene.quantities import Density, Extent, Inertia, Mass
from engine.scene.values import STRICT, AxisName, Position


@dataclass(frozen=True, config=STRICT)
class Cylinder:
    """A solid cylinder."""

    radius: Extent
    """Radius."""
    length: Extent
    """Length along its axis."""
    axis: AxisName = "x"
    """Body axis it lies along."""


@dataclass(frozen=True, config=STRICT)
class Body:
    """A rigid body. All positions and directions below are measured in its frame; a shape is centred on ``center``.

    Mass properties come from a shape with ``density`` or ``mass``, or from ``mass`` and ``inertia``. An explicit ``inertia`` wins
    over the shape, which is then for drawing only.
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
    """Mass, instead of a density."""
    center: Position = (0.0, 0.0, 0.0)
    """Mass centre (and middle of the shape) in the body's frame."""
    inertia: tuple[Inertia, ...] | None = None
    """Inertia about the mass centre in the body's axes: (xx, yy, zz) or (xx, yy, zz, xy, xz, yz), products with the
    sign they have in the matrix; (0, 0, 0) is a point mass."""
    points: dict[str, Position] = field(default_factory=dict)
    """Named points in the body's frame: places for joints and springs, and outputs."""
    color: str | None = None
    """Colour in pictures: a name or #rrggbb."""


@dataclass(frozen=True, config=STRICT)
class Ground:
    """The fixed world, of which only the named points matter."""

    points: dict[str, Position] = field(default_factory=dict)
    """Named points of the world."""
