"""What files may have besides a scene's own keys: assemblies of parts, and copies of them. They become plain bodies and joints
when a scene is read (``written``); these classes say their keys."""

from __future__ import annotations

from dataclasses import field
from typing import Annotated, Literal

from pydantic.dataclasses import dataclass

from trunnion.scene.data_classes.bodies import Body, Ground, Orientation
from trunnion.scene.data_classes.field_types import GROUP, SCALAR, STRICT, Position, either
from trunnion.scene.data_classes.joints import Joint
from trunnion.scene.data_classes.loads import Applied, Input
from trunnion.scene.units.quantities import Angle, Number

AxisLetter = Literal["x", "y", "z"]


@dataclass(frozen=True, config=STRICT)
class Mirror:
    """Two copies: the assembly and its mirror image."""

    axis: AxisLetter
    """Axis that the mirror is square to."""
    through: Position = (0.0, 0.0, 0.0)
    """A point of the mirror."""


@dataclass(frozen=True, config=STRICT)
class Rotate:
    """Copies around an axis."""

    times: int
    """How many there are, the first one with them."""
    axis: AxisLetter = "z"
    """Direction of the axis."""
    by: Angle | None = None
    """Angle from each copy to the next; default: they share a full turn."""
    through: Position = (0.0, 0.0, 0.0)
    """A point of the axis."""


@dataclass(frozen=True, config=STRICT)
class Line:
    """Copies in a row."""

    times: int
    """How many there are, the first one with them."""
    step: Position
    """From each copy to the next."""


@dataclass(frozen=True, config=STRICT)
class Copies:
    """How an assembly is repeated: one of the three. Copies are numbered from 1, and {i} stands for the number."""

    mirror: Annotated[
        Annotated[AxisLetter, SCALAR] | Annotated[Mirror, GROUP], either("an axis (x, y, z) or a group with axis, through")
    ] | None = None
    """The assembly and its mirror image; with an axis alone, the mirror goes through the origin."""
    rotate: Rotate | None = None
    """Copies around an axis."""
    line: Line | None = None
    """Copies in a row."""


@dataclass(frozen=True, config=STRICT)
class Part:
    """What an assembly is made of, in a file or below ``use``. Names that it does not have mean those of the scene around it."""

    title: str = ""
    """One line about it."""
    parameters: dict[str, Number] = field(default_factory=dict)
    """Its parameters, with the values they have unless ``with`` gives others."""
    bodies: dict[str, Body] = field(default_factory=dict)
    """Its bodies; body rod of assembly leg is called leg_rod."""
    joints: dict[str, Joint] = field(default_factory=dict)
    """Its joints, which are named in the same way."""
    forces: dict[str, Applied] = field(default_factory=dict)
    """Its forces, torques and springs."""
    inputs: dict[str, Input] = field(default_factory=dict)
    """Its inputs."""
    ground: Ground = field(default_factory=Ground)
    """Its points of the ground."""
    points: dict[str, str] = field(default_factory=dict)
    """Names for points of its bodies: top: rod.end is leg.top outside."""
    assemblies: dict[str, Assembly] = field(default_factory=dict)
    """Assemblies that it has itself."""


@dataclass(frozen=True, config=STRICT)
class Assembly:
    """Parts that belong together, from a file or a group, with values for their parameters, placed, and copied."""

    use: Annotated[Annotated[str, SCALAR] | Annotated[Part, GROUP], either("the name of a file, or a group of parts")]
    """A file beside this one, or the parts themselves."""
    given: dict[str, Number] = field(default_factory=dict)
    """Values for its parameters, which may be expressions of the parameters around it."""
    position: Position | None = None
    """Where the assembly's origin is; all its bodies must be placed."""
    orientation: Orientation | None = None
    """How it is turned about its origin: angles about x, y, z."""
    copies: Copies | None = None
    """Mirror, rotate or line: the assembly several times."""

    __key_names__ = {"given": "with"}  # noqa: RUF012  (a word of Python cannot be the name of a field)
