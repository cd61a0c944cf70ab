"""Joints of a scene: sides and frames, friction, start values, springs, stops, drives."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

from trunnion.basics.lazy_data_classes import validated
from trunnion.basics.number_declarations import POSITIVE, Bound, Order
from trunnion.elements.friction import DEFAULT
from trunnion.elements.friction import numbers as law_numbers
from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes.field_types import (
    GROUP,
    LIST,
    SCALAR,
    STRICT,
    Direction,
    Exactly,
    PointOf,
    Says,
    Tag,
    either,
    with_fields,
)
from trunnion.scene.data_classes.friction_keys import LawName, Wear, of_joints, of_scene
from trunnion.scene.data_classes.joint_couplings import Curve, Mimic, Profile, Slot
from trunnion.scene.data_classes.signals import Drive, FromInput, Latch, Load, Motor, Signal, load_or
from trunnion.scene.data_classes.unilateral_contact import Unilateral
from trunnion.scene.force_laws.registry import REGISTRY as LAWS
from trunnion.scene.units.numbers_with_units import Angle, AnyUnit, Extent, NotNegative, Number, Per, Positive


@validated(frozen=True, config=STRICT)
class Side:
    """One side of a joint: a body, the joint definition point and the joint frame, in that body's frame. e1 is along ``axis``, e2
    points towards ``reference``, and e3 = e1 x e2. At q = 0 the frames of the two sides coincide."""

    body: str
    """Name of the body, or ground."""
    point: PointOf = (0.0, 0.0, 0.0)
    """Joint definition point."""
    axis: Direction | None = None
    """e1 of this side; default: the joint's ``axis``."""
    reference: Direction | None = None
    """Direction that gives e2 of this side; default: the joint's ``reference``."""


NormalForce = Literal["exact", "adams"]


@validated(frozen=True, config=STRICT)
@with_fields(of_joints())
class Friction:
    """The frictional contact of a joint: geometry of the pin, and the law between pin and bearing."""

    law: LawName | None = None
    """Friction law; default: the scene's."""
    normal_force: NormalForce | None = None
    """Computation of the normal force; default: the scene's."""

    if TYPE_CHECKING:

        def __init__(self, **given: Any) -> None: ...
        def __getattr__(self, name: str) -> Any: ...


@validated(frozen=True, config=STRICT)
@with_fields(of_scene())
class FrictionDefaults:
    """Default values for frictional joints without values of their own."""

    law: LawName = DEFAULT
    """Friction law."""
    normal_force: NormalForce = "exact"
    """exact: from the contact equations; adams: the approximation that the program Adams uses."""

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...


@validated(frozen=True, config=STRICT)
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


@validated(frozen=True, config=STRICT)
class Start:
    """Start values of a joint. The condition that loops are closed determines values that are not given. Given values are changed
    as little as possible, and a note reports each change. ``use`` makes the values of a joint exact, or a guess."""

    q: Coordinates | None = None
    """Coordinates: a number, a list, or axis and angle for a ball."""
    qd: Rates | None = None
    """Rates: a number or a list."""
    use: Literal["exact", "rounded", "guess"] = "rounded"
    """exact: loops never change the values; the run is refused if loops cannot be closed. rounded: the values may change where
    loops cannot be closed otherwise. guess: the search for closed loops begins at the values, and may change them freely."""


@validated(frozen=True, config=STRICT)
@with_fields([(law.key, law.data | None, None, law.text) for law in LAWS.values() if law.data])
class Nonlinear:
    """Nonlinear springs and dampers along a freedom, or along the line between two points; their forces add up."""

    if TYPE_CHECKING:

        def __init__(self, **given: Any) -> None: ...


@validated(frozen=True, config=STRICT)
class Spring:
    """A torque or force of -stiffness (q - rest) along one freedom of a joint."""

    stiffness: NotNegative
    """N/m, or N*m/rad."""
    rest: Number = 0.0
    """Coordinate at which the torque or force is 0."""


ORDERS = {
    "friction": tuple(n.order for n, _ in law_numbers().values() if n.order is not None),
    "end_stops": (Order("lower", "upper", strict=True),),
}
"""{field of a joint: pairs of the field's numbers}. The first number of a pair must be below the second."""


@validated(frozen=True, config=STRICT)
class EndStops:
    """Compliant end stops (Hunt and Crossley): force = stiffness * depth * (1 + damping * rate of depth), never negative."""

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
else:
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
    Annotated[Entry, SCALAR] | Annotated[tuple[Entry | None, ...], LIST], either("a number, or a list with one entry per freedom")
]
GroupPerFreedom = Annotated[
    Annotated[Entry, GROUP] | Annotated[tuple[Entry | None, ...], LIST],
    either("a group of keys, or a list with one entry per freedom"),
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
    load_or("a load, or a list with one entry per freedom"),
]


@validated(frozen=True, config=STRICT)
class Joint:
    """A joint between two parts.

    ``axis`` and ``reference`` apply to both sides, except to a side with its own values. Travels and angles describe the motion of
    the outboard part relative to the inboard part; at q = 0 the frames of both sides coincide. ``spring``, ``damping``,
    ``nonlinear``, ``rotor_inertia``, ``end_stops``, ``drive``, ``effort`` and ``motor`` are lists with one entry per freedom; a
    joint with one freedom may give the entry without a list.
    """

    type: JointType
    """Kind of joint."""
    inboard: SideOf
    """The part relative to which the motion is measured: "body", "body.point", or a group."""
    outboard: SideOf
    """The part whose motion is measured: "body", "body.point", or a group."""
    axis: Direction | None = None
    """e1, in both bodies' frames; between placed bodies, in the world."""
    reference: Direction | None = None
    """The component of this direction normal to e1 gives e2; default: the next axis of the cycle x, y, z."""
    pin: Literal["inboard", "outboard"] = "inboard"
    """Part that carries the pin (ball, journal, shaft), or the inner part of a sleeve."""
    ends: Literal["inboard", "outboard", "overlap"] | None = None
    """Part whose ends carry the contacts, for example the short sleeve on a long shaft; default: the part with the pin. overlap:
    the contacts are at the ends of the region in which two parts of finite length overlap; this region changes as the parts
    slide."""
    pitch: Annotated[float, Per("m", Bound(nonzero=True))] | None = None
    """For a screw, the travel per turn; for a belt or chain, the distance between teeth."""
    teeth: tuple[Count, ...] | None = None
    """Numbers of teeth: for a gear or belt, of the inboard and the outboard wheel; for a rack, of its wheel."""
    module: Annotated[float, Per("m", POSITIVE)] | None = None
    """Pitch diameter of a gear divided by its number of teeth."""
    radii: tuple[Extent, ...] | None = None
    """Radii of wheels without teeth: inboard wheel, then outboard wheel."""
    lead_angle: Annotated[float, Per("rad", Bound(-1.5, 1.5, advice="a lead angle is at most 85 deg"))] | None = None
    """Lead angle of a worm at its pitch circle; negative for a left-handed thread. ``teeth`` are the threads of the worm, then the
    teeth of its wheel; ``module`` is the axial module of the worm."""
    internal: Annotated[bool, Exactly()] = False
    """Whether the larger of two gears has its teeth inside, or whether the follower of a cam is inside the cam."""
    profile: Profile | None = None
    """The profile of a cam. The inboard part carries the cam; its axis is the joint's e1."""
    roller: Extent | None = None
    """Radius of the roller around the outboard point of a cam's follower, of a point on a curve, or of a pin in a slot. The
    profile or curve is the path of the roller's centre. Friction acts at the roller's rim, so that a roller that turns with its
    body rolls."""
    curve: Curve | None = None
    """The curve (slot, groove, rail) on which a point of the outboard part stays, in the plane of the inboard e2 and e3."""
    slot: Slot | None = None
    """Play, ends and mouths of the slot of a pin_in_slot, whose ``curve`` is the middle of the slot."""
    unilateral: Unilateral | None = None
    """Contact that begins and ends: the joint only pushes. For cams, points on curves, points on planes, and pins in slots."""
    mimic: Mimic | None = None
    """The leading joint, of which this joint's coordinate is a linear function; both joints have one freedom."""
    ratio: Annotated[float, Per("1", Bound(nonzero=True))] | None = None
    """For a gearbox, the angle of the input (inboard) shaft per angle of the output (outboard) shaft; negative if the shafts turn
    in opposite senses."""
    length: Extent | None = None
    """Length of a rod; default: the distance of its two points in the poses of the placed bodies."""
    crossed: Annotated[bool, Exactly()] = False
    """Whether a belt is crossed, so that its pulleys turn in opposite directions."""
    stiffness: Annotated[float, Per("N/m", POSITIVE)] | None = None
    """Radial stiffness of each contact, default 1e8 N/m. The stiffness decides how frictional joints of redundant loops share the
    load."""
    friction: Friction | None = None
    """The frictional contact; without this key the joint is ideal."""
    wear: Wear | None = None
    """Wear of the joint's contacts, for ``trunnion wear``."""
    start: Start | None = None
    """Start values."""
    spring: GroupPerFreedom[Spring] | None = None
    """Springs along the freedoms."""
    damping: NumberPerFreedom[DampingOfFreedom] | None = None
    """Viscous damping along the freedoms, independent of the normal force: N*s/m or N*m*s/rad."""
    nonlinear: GroupPerFreedom[Nonlinear] | None = None
    """Nonlinear springs and dampers along the freedoms."""
    rotor_inertia: NumberPerFreedom[InertiaOfFreedom] | None = None
    """Additional inertia of the joint's own motion, kg or kg*m^2. For a geared motor: rotor inertia times the gear ratio squared.
    All rotations of a free or spherical joint have the same value. A joint with rotor inertia is never cut."""
    end_stops: GroupPerFreedom[EndStops] | None = None
    """End stops of the freedoms."""
    latch: GroupPerFreedom[Latch] | None = None
    """Latches of the freedoms."""
    drive: GroupPerFreedom[Drive] | None = None
    """Prescribed motion of the freedoms."""
    effort: Efforts | None = None
    """Force or torque along the freedoms, on the outboard part."""
    motor: GroupPerFreedom[Motor] | None = None
    """Motors along the freedoms, with a linear torque-speed characteristic."""
    cut: Annotated[bool, Exactly()] | None = None
    """Whether a closed loop is opened at this joint: true or false; default: the program chooses the joints to open."""
    at: PointOf | None = None
    """Position of a joint between placed bodies: a point in the world, or "body.point"; default: the point that a side names."""
