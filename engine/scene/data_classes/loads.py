"""Forces, torques, springs and bushings applied to bodies, and external inputs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

from trunnion.basics.lazy_data_classes import validated
from trunnion.basics.number_declarations import NOT_NEGATIVE, POSITIVE
from trunnion.scene.data_classes.drag_and_attraction import Drag, PointGravity
from trunnion.scene.data_classes.field_types import LIST, SCALAR, STRICT, Direction, Discriminator, Tag, either
from trunnion.scene.data_classes.force_field import Field
from trunnion.scene.data_classes.joints import Nonlinear
from trunnion.scene.data_classes.signals import LoadVector
from trunnion.scene.units.numbers_with_units import Damping, Number, Per, Stiffness, Time


@validated(frozen=True, config=STRICT)
class Force:
    """A force at a point of a body."""

    type: Literal["force"]
    """Kind of load: a force."""
    on: str
    """"body.point", or "body" for its mass centre."""
    force: LoadVector
    """Components, N."""
    frame: Literal["world", "body"] = "world"
    """Frame whose axes the components refer to."""


@validated(frozen=True, config=STRICT)
class Torque:
    """A torque on a body."""

    type: Literal["torque"]
    """Kind of load: a torque."""
    on: str
    """The body on which the torque acts."""
    torque: LoadVector
    """Components, N*m."""
    frame: Literal["world", "body"] = "world"
    """Frame whose axes the components refer to."""


@validated(frozen=True, config=STRICT)
class SpringDamper:
    """Spring and damper along the line between two points."""

    type: Literal["spring_damper"]
    """Kind of load: a spring with a damper."""
    between: tuple[str, str]
    """The two points: "body.point", or "body" for its frame origin."""
    stiffness: Stiffness = 0.0
    """Force per elongation."""
    damping: Damping = 0.0
    """Force per rate of elongation."""
    length: Annotated[float, Per("m", NOT_NEGATIVE)] = 0.0
    """Length at which the spring force is 0."""
    nonlinear: Nonlinear | None = None
    """Nonlinear springs and dampers along the same line, over the length and its rate."""


def _three(unit: str, wanted: str) -> Any:
    one = Annotated[float, Per(unit, NOT_NEGATIVE)]
    three: Any = tuple.__class_getitem__((one,) * 3)
    return Annotated[Annotated[one, SCALAR] | Annotated[three, LIST], either(f"{wanted}, or a list of three along e1, e2, e3")]


if TYPE_CHECKING:
    Along: TypeAlias = float | tuple[float, float, float]
    TurningAlong: TypeAlias = Along
    DampedAlong: TypeAlias = Along
    SlowedAlong: TypeAlias = Along
else:
    Along, TurningAlong = _three("N/m", "a stiffness"), _three("N*m/rad", "a rotational stiffness")
    DampedAlong, SlowedAlong = _three("N*s/m", "a damping"), _three("N*m*s/rad", "a rotational damping")


@validated(frozen=True, config=STRICT)
class Bushing:
    """A rubber bush: stiffness and damping between two parts in all six directions, along the axes of the first part. The forces
    and torques of the bush are 0 when the points and axes of both parts coincide."""

    type: Literal["bushing"]
    """Kind of load: a bushing."""
    between: tuple[str, str]
    """The two parts: "body.point", or "body" for its frame origin; between placed bodies, the rules for the sides of a joint
    apply."""
    axis: Direction | None = None
    """e1, in both bodies' frames; between placed bodies, in the world. Default: x, y, z."""
    reference: Direction | None = None
    """The component of this direction normal to e1 gives e2; default: the next axis of the cycle x, y, z."""
    stiffness: Along = 0.0
    """Force per offset along e1, e2, e3."""
    damping: DampedAlong = 0.0
    """Force per rate of offset."""
    turning_stiffness: TurningAlong = 0.0
    """Torque per angle about e1, e2, e3; a rotation q about one axis gives k sin q."""
    turning_damping: SlowedAlong = 0.0
    """Torque per angular velocity."""


APPLIED = {"force": Force, "torque": Torque, "spring_damper": SpringDamper, "bushing": Bushing, "drag": Drag, "field": Field,
           "point_gravity": PointGravity}  # fmt: skip


def _kind(value: Any) -> str:
    kind = value.get("type") if isinstance(value, dict) else getattr(value, "type", None)
    return f"·{kind}"


Applied = Annotated[
    Annotated[Force, Tag("·force")]
    | Annotated[Torque, Tag("·torque")]
    | Annotated[SpringDamper, Tag("·spring_damper")]
    | Annotated[Bushing, Tag("·bushing")]
    | Annotated[Drag, Tag("·drag")]
    | Annotated[Field, Tag("·field")]
    | Annotated[PointGravity, Tag("·point_gravity")],
    Discriminator(_kind, custom_error_type="unknown_kind", custom_error_message=f"type: {', '.join(APPLIED)}"),
]


@validated(frozen=True, config=STRICT)
class Input:
    """A named external input, whose value is given from outside during a run."""

    start: Number = 0.0
    """Value until the caller sets another value."""
    begin: Time | None = None
    """Time from which the caller's values apply. Until then, ``start`` applies. Default: the start of the run."""
    unit: str = "1"
    """SI unit of the input."""
    description: str = ""
    """Description of the input."""
    bandwidth: Annotated[float, Per("rad/s", POSITIVE)] = 100.0
    """Bandwidth of the critically damped filter through which a prescribed motion follows the input, rad/s."""
