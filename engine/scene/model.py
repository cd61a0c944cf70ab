"""The scene: what a user says about a mechanism, as frozen dataclasses (the YAML file is the same, key for key).

Numbers are SI inside; wherever a quantity is expected a string with a unit ("45 deg", "30 mm", "60 rpm") is accepted and
converted at the door. ``schema.py`` publishes these classes as JSON Schema, ``load.py`` reads files with line numbers,
``check.py`` finds the mistakes that need more than one field to see.
"""

from __future__ import annotations

from dataclasses import field
from typing import Annotated, Literal

from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass

from engine.scene.quantities import (
    Acceleration,
    Angle,
    Count,
    Damping,
    Density,
    Inertia,
    Length,
    Mass,
    Number,
    Per,
    Stiffness,
    Time,
    Velocity,
)

STRICT = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

Vector = tuple[Number, Number, Number]
Position = tuple[Length, Length, Length]
AxisName = Literal["x", "y", "z", "-x", "-y", "-z"]
Direction = AxisName | Vector
"""A direction in a body's frame: a name or three numbers of any length (normalised)."""


# -- signals: functions of time given as data, never as code ------------------------------------------------------------------

@dataclass(frozen=True, config=STRICT)
class Constant:
    """Value (of a load), or steady rate (of a drive: q = start + rate t)."""

    rate: Number
    start: Number = 0.0


@dataclass(frozen=True, config=STRICT)
class Ramp:
    """Linear from ``start`` to ``end`` between ``begin`` and ``begin + duration`` (loads: the value; drives: the rate,
    q = origin at t = 0)."""

    start: Number
    end: Number
    duration: Time
    begin: Time = 0.0
    origin: Number = 0.0


@dataclass(frozen=True, config=STRICT)
class Harmonic:
    """offset + amplitude sin(2 pi frequency t + phase)."""

    amplitude: Number
    frequency: Annotated[float, Per("Hz")]
    phase: Angle = 0.0
    offset: Number = 0.0


@dataclass(frozen=True, config=STRICT)
class Table:
    """Values at times; drives follow a cubic spline (natural ends, linear beyond them), loads straight lines (held beyond)."""

    time: tuple[Time, ...]
    value: tuple[Number, ...]


@dataclass(frozen=True, config=STRICT)
class FromInput:
    """The scene's named external input."""

    input: str


@dataclass(frozen=True, config=STRICT)
class Drive:
    """Prescribed motion of one joint coordinate; exactly one of the kinds. The effort it takes is an output."""

    constant: Constant | None = None
    ramp: Ramp | None = None
    harmonic: Harmonic | None = None
    table: Table | None = None


@dataclass(frozen=True, config=STRICT)
class Signal:
    """A load that changes with time; exactly one of the kinds (a plain number is a constant load)."""

    ramp: Ramp | None = None
    harmonic: Harmonic | None = None
    table: Table | None = None


Load = Number | FromInput | Signal
LoadVector = tuple[Load, Load, Load]


# -- bodies -------------------------------------------------------------------------------------------------------------------

@dataclass(frozen=True, config=STRICT)
class Cylinder:
    radius: Length
    length: Length
    axis: AxisName = "x"


@dataclass(frozen=True, config=STRICT)
class Body:
    """A rigid body. Its frame is where the numbers below are measured; a shape is centred on ``center``.

    Mass properties: a shape with ``density`` or ``mass``, or ``mass`` + ``inertia``. An explicit ``inertia`` wins over the
    shape, which is then for drawing only. ``inertia`` is about the mass centre in the body's axes: (xx, yy, zz) or
    (xx, yy, zz, xy, xz, yz), products with the sign they have in the matrix; (0, 0, 0) is a point mass.
    """

    box: Position | None = None
    cylinder: Cylinder | None = None
    sphere: Length | None = None
    density: Density | None = None
    mass: Mass | None = None
    center: Position = (0.0, 0.0, 0.0)
    inertia: tuple[Inertia, ...] | None = None
    points: dict[str, Position] = field(default_factory=dict)
    color: str | None = None


@dataclass(frozen=True, config=STRICT)
class Ground:
    """The fixed world; only its named points."""

    points: dict[str, Position] = field(default_factory=dict)


# -- joints -------------------------------------------------------------------------------------------------------------------

@dataclass(frozen=True, config=STRICT)
class Side:
    """One part of a joint: the body, the joint definition point on it and the joint frame (e1 along ``axis``, e2 towards
    ``reference``, e3 = e1 x e2), in that body's frame. At q = 0 the frames of the two sides coincide."""

    body: str
    point: str | Position = (0.0, 0.0, 0.0)
    axis: Direction | None = None
    reference: Direction | None = None


Law = Literal["coulomb", "regularized", "viscous", "stribeck", "lugre"]


@dataclass(frozen=True, config=STRICT)
class Friction:
    """The frictional contact of a joint (geometry of the pin and the law between pin and bearing).

    mu           coefficient of (sliding) friction; for ``viscous`` see ``viscosity``.
    radius       of ball, journal or shaft; universal: one number or two (journal 1 on u1, journal 2 on u2).
    half_length  c: the contact points of a journal sit at -c and +c from its centre (universal: one or two; prismatic: sleeve).
    half_width, half_height  a (along e2), b (along e3) of a prismatic guide.
    viscosity    friction coefficient per sliding speed, s/m (law ``viscous``).
    thrust_radius  arm at which an axial thrust on a revolute journal rubs (the paper's end face has none).
    law, v_eps, normal_force  override the scene's defaults.
    """

    mu: Count = 0.0
    mu_static: Count | None = None
    radius: Length | tuple[Length, Length] | None = None
    half_length: Length | tuple[Length, Length] | None = None
    half_width: Length | None = None
    half_height: Length | None = None
    viscosity: Annotated[float, Per("s/m")] | None = None
    thrust_radius: Length | None = None
    law: Law | None = None
    v_eps: Velocity | None = None
    normal_force: Literal["exact", "adams"] | None = None


@dataclass(frozen=True, config=STRICT)
class FrictionDefaults:
    law: Law = "regularized"
    v_eps: Velocity = 1e-4
    normal_force: Literal["exact", "adams"] = "exact"


@dataclass(frozen=True, config=STRICT)
class AxisAngle:
    axis: Direction
    angle: Angle


Coordinates = Number | tuple[Number, ...] | AxisAngle


@dataclass(frozen=True, config=STRICT)
class Start:
    """Start values of a joint: q (a number, a list, or axis and angle for a ball), qd. What is left out is free to be
    assembled; what is given is kept as well as the loops allow, and any change is reported."""

    q: Coordinates | None = None
    qd: Number | tuple[Number, ...] | None = None


@dataclass(frozen=True, config=STRICT)
class Spring:
    """Torque or force -stiffness (q - rest) along one freedom of a joint."""

    stiffness: Number
    rest: Number = 0.0


@dataclass(frozen=True, config=STRICT)
class Stops:
    """Compliant end stops: force stiffness*depth*(1 + damping*depth rate), never pulling (Hunt and Crossley)."""

    stiffness: Number
    lower: Number | None = None
    upper: Number | None = None
    damping: Number = 0.0


JointType = Literal[
    "fixed", "free", "revolute", "cylindrical", "prismatic", "spherical", "universal", "planar", "screw"
]


@dataclass(frozen=True, config=STRICT)
class Joint:
    """A joint between two parts. ``inboard``/``outboard``: "body", "body.point", or a Side.

    ``axis``/``reference`` are used for both sides where a side gives none of its own. Universal: u1 = inboard e1,
    u2 = outboard e2 (they coincide with the other side's e1, e2 at q = 0). Freedoms in order:
    revolute (angle about e1) · prismatic (travel of outboard along e1) · cylindrical (travel, angle) ·
    universal (angle about u1, about u2) · spherical (quaternion; rates: angular velocity of outboard relative to inboard in
    the inboard joint frame) · free (travel along e1 e2 e3, quaternion) · planar (travel along e2, e3, angle about e1) ·
    screw (angle; travel = pitch * turns).
    Lists ``spring``, ``damping``, ``stops``, ``drive``, ``effort`` have one entry a freedom (rate); a single entry
    stands for the only freedom of a one-freedom joint.
    """

    type: JointType
    inboard: str | Side
    outboard: str | Side
    axis: Direction | None = None
    reference: Direction | None = None
    pin: Literal["inboard", "outboard"] = "inboard"
    pitch: Length | None = None
    friction: Friction | None = None
    start: Start | None = None
    spring: Spring | tuple[Spring | None, ...] | None = None
    damping: Number | tuple[Number | None, ...] | None = None
    stops: Stops | tuple[Stops | None, ...] | None = None
    drive: Drive | tuple[Drive | None, ...] | None = None
    effort: Load | tuple[Load | None, ...] | None = None
    cut: bool | None = None


# -- loads --------------------------------------------------------------------------------------------------------------------

@dataclass(frozen=True, config=STRICT)
class Force:
    """A force at a point of a body ("body" or "body.point"; "body" alone: its mass centre), components in the world or in
    the body's frame."""

    type: Literal["force"]
    on: str
    force: LoadVector
    frame: Literal["world", "body"] = "world"


@dataclass(frozen=True, config=STRICT)
class Torque:
    """A torque on a body, components in the world or in the body's frame."""

    type: Literal["torque"]
    on: str
    torque: LoadVector
    frame: Literal["world", "body"] = "world"


@dataclass(frozen=True, config=STRICT)
class SpringDamper:
    """Spring and damper along the line between two points ("body.point", or "body" for its frame origin)."""

    type: Literal["spring_damper"]
    between: tuple[str, str]
    stiffness: Stiffness = 0.0
    damping: Damping = 0.0
    length: Length = 0.0


Applied = Annotated[Force | Torque | SpringDamper, Field(discriminator="type")]


@dataclass(frozen=True, config=STRICT)
class Input:
    """A named external input; ``start`` is its value until someone sets it."""

    start: Number = 0.0
    unit: str = "1"
    description: str = ""


# -- the whole ----------------------------------------------------------------------------------------------------------------

@dataclass(frozen=True, config=STRICT)
class Simulation:
    """How ``simulate`` runs the scene when not told otherwise."""

    until: Time = 10.0
    every: Time | None = None
    rtol: Count = 1e-6
    method: str = "auto"


@dataclass(frozen=True, config=STRICT)
class Scene:
    """A mechanism: bodies, joints, loads. ``tunable`` names numbers (dotted paths, patterns) that stay run-time parameters
    even when they are zero as written."""

    bodies: dict[str, Body]
    joints: dict[str, Joint]
    name: str = "scene"
    schema: Literal[1] = 1
    title: str = ""
    gravity: tuple[Acceleration, Acceleration, Acceleration] = (0.0, 0.0, -9.81)
    ground: Ground = field(default_factory=Ground)
    friction: FrictionDefaults = field(default_factory=FrictionDefaults)
    forces: dict[str, Applied] = field(default_factory=dict)
    inputs: dict[str, Input] = field(default_factory=dict)
    outputs: tuple[str, ...] = ("*",)
    simulation: Simulation = field(default_factory=Simulation)
    tunable: tuple[str, ...] = ()

