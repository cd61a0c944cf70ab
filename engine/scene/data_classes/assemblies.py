"""Keys of assemblies of parts and of their copies. Only files have these keys: when a scene is read, assemblies become plain
bodies and joints (``composition``). The classes here define the keys for checks, hints and the schema."""

from __future__ import annotations

from dataclasses import field
from typing import Annotated, Literal

from trunnion.basics.lazy_data_classes import validated
from trunnion.scene.data_classes.bodies import Body, Ground, Orientation
from trunnion.scene.data_classes.field_types import GROUP, SCALAR, STRICT, Position, either
from trunnion.scene.data_classes.joints import Joint
from trunnion.scene.data_classes.loads import Applied, Input
from trunnion.scene.units.numbers_with_units import Angle, Number

AxisLetter = Literal["x", "y", "z"]


@validated(frozen=True, config=STRICT)
class Mirror:
    """Two copies: the assembly and its mirror image."""

    axis: AxisLetter
    """Axis normal to the mirror plane."""
    through: Position = (0.0, 0.0, 0.0)
    """A point of the mirror plane."""


@validated(frozen=True, config=STRICT)
class Rotate:
    """Copies around an axis."""

    times: int
    """Number of copies, including the first."""
    axis: AxisLetter = "z"
    """Direction of the axis."""
    by: Angle | None = None
    """Angle from each copy to the next; default: a full turn divided by the number of copies."""
    through: Position = (0.0, 0.0, 0.0)
    """A point of the axis."""


@validated(frozen=True, config=STRICT)
class Line:
    """Copies in a row."""

    times: int
    """Number of copies, including the first."""
    step: Position
    """Displacement from each copy to the next."""


@validated(frozen=True, config=STRICT)
class Copies:
    """How an assembly is repeated: exactly one of mirror, rotate, line. Copies are numbered from 1; {i} stands for the number."""

    mirror: Annotated[
        Annotated[AxisLetter, SCALAR] | Annotated[Mirror, GROUP], either("an axis (x, y, z) or a group with axis, through")
    ] | None = None
    """The assembly and its mirror image. If only an axis is given, the mirror plane contains the origin."""
    rotate: Rotate | None = None
    """Copies around an axis."""
    line: Line | None = None
    """Copies in a row."""


@validated(frozen=True, config=STRICT)
class Part:
    """The contents of an assembly, in a file or below ``use``. A name that the part does not define refers to the enclosing
    scene."""

    title: str = ""
    """One line about the part."""
    parameters: dict[str, Number] = field(default_factory=dict)
    """Parameters of the part, with default values that ``with`` may replace."""
    bodies: dict[str, Body] = field(default_factory=dict)
    """Bodies. Body rod of assembly leg gets the name leg_rod."""
    joints: dict[str, Joint] = field(default_factory=dict)
    """Joints, renamed in the same way as bodies."""
    forces: dict[str, Applied] = field(default_factory=dict)
    """Forces, torques and springs."""
    inputs: dict[str, Input] = field(default_factory=dict)
    """External inputs of the part."""
    ground: Ground = field(default_factory=Ground)
    """Named points of the ground."""
    points: dict[str, str] = field(default_factory=dict)
    """Names for points of the part's bodies: with top: rod.end, the scene may write leg.top."""
    assemblies: dict[str, Assembly] = field(default_factory=dict)
    """Assemblies inside this one."""


@validated(frozen=True, config=STRICT)
class Assembly:
    """Parts that belong together, from a file or a group of keys. The scene may place the parts, copy them, and set their
    parameters."""

    use: Annotated[Annotated[str, SCALAR] | Annotated[Part, GROUP], either("the name of a file, or a group of parts")]
    """The name of a file in the folder of this file, or the parts themselves."""
    given: dict[str, Number] = field(default_factory=dict)
    """Values for the part's parameters. They may be expressions of the enclosing scene's parameters."""
    position: Position | None = None
    """Position of the assembly's origin; all its bodies must be placed."""
    orientation: Orientation | None = None
    """Rotation of the assembly about its origin, by angles about x, y, z."""
    copies: Copies | None = None
    """Repetition of the assembly: mirror, rotate or line."""

    __key_names__ = {"given": "with"}  # noqa: RUF012  (``with`` is a keyword of Python and cannot name a field)
