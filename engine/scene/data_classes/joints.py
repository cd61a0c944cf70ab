"""Joints of a scene: sides and frames, friction, start values, springs, stops, drives."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

from pydantic import Strict, Tag
from pydantic.dataclasses import dataclass

from trunnion.basics.number_declarations import POSITIVE, Bound, Order
from trunnion.elements.friction import DEFAULT
from trunnion.elements.friction import numbers as law_numbers
from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes.field_types import GROUP, LIST, SCALAR, STRICT, Direction, PointOf, Says, either
from trunnion.scene.data_classes.friction_keys import LawName, Wear, of_joints, of_scene, with_fields
from trunnion.scene.data_classes.joint_couplings import Curve, Mimic, Profile
from trunnion.scene.data_classes.signals import Drive, FromInput, Latch, Load, Motor, Signal, load_or
from trunnion.scene.units.quantities import Angle, AnyUnit, Extent, NotNegative, Number, Per, Positive


@dataclass(frozen=True, config=STRICT)
class Side:
    """One part of a joint: the body, the joint definition point on it and the joint frame (e1 along ``axis``, e2
    towards ``reference``, e3 = e1 x e2), in that body's frame. At q = 0 the frames of the two sides coincide."""

    body: str
    """Name of the body, or ground."""
    point: PointOf = (0.0, 0.0, 0.0)
    """Joint definition point."""
    axis: Direction | None = None
    """e1 of this side, where it differs from the joint's."""
    reference: Direction | None = None
    """Direction e2 leans to on this side, where it differs from the joint's."""


NormalForce = Literal["exact", "adams"]


@dataclass(frozen=True, config=STRICT)
@with_fields(of_joints())
class Friction:
    """The frictional contact of a joint: geometry of the pin, and the law between pin and bearing."""

    law: LawName | None = None
    """Friction law, where it differs from the scene's."""
    normal_force: NormalForce | None = None
    """How the normal force is found, where it differs from the scene's."""

    if TYPE_CHECKING:

        def __init__(self, **given: Any) -> None: ...
        def __getattr__(self, name: str) -> Any: ...


@dataclass(frozen=True, config=STRICT)
@with_fields(of_scene())
class FrictionDefaults:
    """What frictional joints use where they do not give their own."""

    law: LawName = DEFAULT
    """Friction law."""
    normal_force: NormalForce = "exact"
    """exact: from the contact equations; adams: by the approximation of the program Adams."""

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...


@dataclass(frozen=True, config=STRICT)
class AxisAngle:
    """A rotation as an axis in the inboard joint frame and an angle."""

    axis: Direction
    """Axis of the rotation."""
    angle: Angle
    """Angle of the rotation."""


Coordinates = Annotated[
    Annotated[Number, SCALAR] | Annotated[tuple[Number, ...], LIST] | Annotated[AxisAngle, GROUP],
    either("a number, a list of numbers, or axis and angle"),
]
Rates = Annotated[Annotated[Number, SCALAR] | Annotated[tuple[Number, ...], LIST], either("a number or a list of numbers")]


@dataclass(frozen=True, config=STRICT)
class Start:
    """Start values of a joint. Closing the loops determines values that are not given, and moves given ones as little as possible;
    any change is reported."""

    q: Coordinates | None = None
    """Coordinates: a number, a list, or axis and angle for a ball."""
    qd: Rates | None = None
    """Rates: a number or a list."""


@dataclass(frozen=True, config=STRICT)
class Spring:
    """A torque or force of -stiffness (q - rest) along one freedom of a joint."""

    stiffness: NotNegative
    """N/m, or N*m/rad."""
    rest: Number = 0.0
    """Coordinate at which it is relaxed."""


ORDERS = {
    "friction": tuple(n.order for n, _ in law_numbers().values() if n.order is not None),
    "end_stops": (Order("lower", "upper", strict=True),),
}
"""For each field of a joint, the numbers in it that must be in order."""


@dataclass(frozen=True, config=STRICT)
class EndStops:
    """Compliant end stops: the force is stiffness*depth*(1 + damping*depth rate) and never pulls (Hunt and Crossley)."""

    stiffness: Positive
    """N/m, or N*m/rad."""
    lower: Number | None = None
    """Coordinate below which the lower end stop presses."""
    upper: Number | None = None
    """Coordinate above which the upper end stop presses."""
    damping: NotNegative = 0.0
    """s/m, or s/rad."""


if TYPE_CHECKING:
    JointType = str
else:  # what is registered is what a scene may say
    JointType = Annotated[
        Literal[tuple(REGISTRY)],
        Says("Freedoms in order: " + " · ".join(f"{k.name} ({k.freedoms})" for k in REGISTRY.values() if k.nv)),
    ]
SideOf = Annotated[
    Annotated[str, SCALAR] | Annotated[Side, GROUP],
    either('"body", "body.point" or a group with body, point, axis, reference'),
]
Entry = TypeVar("Entry")
NumberPerFreedom = Annotated[
    Annotated[Entry, SCALAR] | Annotated[tuple[Entry | None, ...], LIST], either("a number, or a list with one entry a freedom")
]
GroupPerFreedom = Annotated[
    Annotated[Entry, GROUP] | Annotated[tuple[Entry | None, ...], LIST],
    either("a group of keys, or a list with one entry a freedom"),
]
"""One entry for the only freedom of a joint, or a list with one entry for each freedom."""
DampingOfFreedom = Annotated[float, AnyUnit(bound=Bound(0.0, advice="it opposes the motion by itself"))]
InertiaOfFreedom = Annotated[float, AnyUnit(bound=Bound(0.0, advice="an inertia is not negative"))]
Count = Annotated[float, Per("1", POSITIVE)]
Efforts = Annotated[
    Annotated[Number, SCALAR]
    | Annotated[FromInput, Tag("·input")]
    | Annotated[Signal, Tag("·signal")]
    | Annotated[tuple[Load | None, ...], LIST],
    load_or("a load, or a list with one entry a freedom"),
]


@dataclass(frozen=True, config=STRICT)
class Joint:
    """A joint between two parts.

    ``axis``/``reference`` are used for both sides where a side gives none of its own. Travels and angles are those of
    the outboard part as seen from the inboard one; at q = 0 the frames of both sides coincide. Lists ``spring``,
    ``damping``, ``rotor_inertia``, ``end_stops``, ``drive``, ``effort``, ``motor`` have one entry a freedom (rate); a single entry
    stands for the only freedom of a one-freedom joint.
    """

    type: JointType
    """Kind of joint."""
    inboard: SideOf
    """The part the motion is measured from: "body", "body.point", or a group."""
    outboard: SideOf
    """The part whose motion is measured: "body", "body.point", or a group."""
    axis: Direction | None = None
    """e1, in both bodies' frames; between placed bodies, in the world."""
    reference: Direction | None = None
    """Direction e2 leans to; without it the next axis of the cycle x, y, z."""
    pin: Literal["inboard", "outboard"] = "inboard"
    """Part that carries the pin (ball, journal, shaft), or is the inner one (sleeve)."""
    ends: Literal["inboard", "outboard", "overlap"] | None = None
    """Part that contacts sit at the ends of: the short one of a sleeve on a long shaft; overlap: they sit where two parts of finite
    length end to touch, which changes as they slide. Without it the part that carries the pin."""
    pitch: Annotated[float, Per("m", Bound(nonzero=True))] | None = None
    """Travel of a screw in one turn; of a belt or chain the distance of its teeth."""
    teeth: tuple[Count, ...] | None = None
    """Numbers of teeth: of the inboard and the outboard wheel of a gear or belt, of the wheel of a rack."""
    module: Annotated[float, Per("m", POSITIVE)] | None = None
    """Pitch diameter of a gear over its number of teeth."""
    radii: tuple[Extent, ...] | None = None
    """Radii of wheels without teeth: of the inboard and the outboard one."""
    internal: Annotated[bool, Strict()] = False
    """Whether the larger of two gears has its teeth inside."""
    profile: Profile | None = None
    """The curve of a cam, which the inboard part carries about the joint's e1."""
    roller: Extent | None = None
    """Radius of the roller that follows a cam, about the outboard point; without it a point follows."""
    curve: Curve | None = None
    """The curve that a point of the outboard part stays on (a slot, a groove, a rail), in the plane of the inboard e2 and e3."""
    mimic: Mimic | None = None
    """The joint whose freedom that of this one follows; both have one freedom."""
    crossed: Annotated[bool, Strict()] = False
    """Whether a belt is crossed, so that its pulleys turn opposite ways."""
    stiffness: Annotated[float, Per("N/m", POSITIVE)] | None = None
    """Radial stiffness of each contact, default 1e8 N/m: decides how frictional joints share what redundant loops leave open."""
    friction: Friction | None = None
    """The frictional contact; without it the joint is ideal."""
    wear: Wear | None = None
    """How fast its contacts wear (trunnion wear)."""
    start: Start | None = None
    """Start values."""
    spring: GroupPerFreedom[Spring] | None = None
    """Springs along the freedoms."""
    damping: NumberPerFreedom[DampingOfFreedom] | None = None
    """Viscous damping along the freedoms, independent of the normal force: N*s/m or N*m*s/rad."""
    rotor_inertia: NumberPerFreedom[InertiaOfFreedom] | None = None
    """Inertia that the joint's own motion turns beside the bodies, kg or kg*m^2: of a geared motor, its rotor's times the square of
    the ratio. All turns of a free or spherical joint have the same; a joint that has one is never cut."""
    end_stops: GroupPerFreedom[EndStops] | None = None
    """End stops of the freedoms."""
    latch: GroupPerFreedom[Latch] | None = None
    """Latches of the freedoms."""
    drive: GroupPerFreedom[Drive] | None = None
    """Prescribed motion of the freedoms."""
    effort: Efforts | None = None
    """Force or torque along the freedoms, on the outboard part."""
    motor: GroupPerFreedom[Motor] | None = None
    """Motors along the freedoms, by their line of torque over speed."""
    cut: Annotated[bool, Strict()] | None = None
    """Whether a closed loop is opened at this joint: true, it is; false, it is not; default: where it is best."""
    at: PointOf | None = None
    """Between placed bodies, where the joint is: a place in the world, or "body.point"; default: the point that a side names."""
