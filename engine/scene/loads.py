"""Forces, torques and springs applied to bodies, and external inputs."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Tag
from pydantic.dataclasses import dataclass

from engine.basics.numbers import NOT_NEGATIVE, POSITIVE
from engine.scene.quantities import Damping, Number, Per, Stiffness
from engine.scene.signals import LoadVector
from engine.scene.values import STRICT


@dataclass(frozen=True, config=STRICT)
class Force:
    """A force at a point of a body."""

    type: Literal["force"]
    """Kind of load: a force."""
    on: str
    """"body.point", or "body" for its mass centre."""
    force: LoadVector
    """Components, N."""
    frame: Literal["world", "body"] = "world"
    """Axes of the components."""


@dataclass(frozen=True, config=STRICT)
class Torque:
    """A torque on a body."""

    type: Literal["torque"]
    """Kind of load: a torque."""
    on: str
    """The body it acts on."""
    torque: LoadVector
    """Components, N*m."""
    frame: Literal["world", "body"] = "world"
    """Axes of the components."""


@dataclass(frozen=True, config=STRICT)
class SpringDamper:
    """Spring and damper along the line between two points."""

    type: Literal["spring_damper"]
    """Kind of load: a spring with a damper."""
    between: tuple[str, str]
    """The two points: "body.point", or "body" for its frame origin."""
    stiffness: Stiffness = 0.0
    """Force per lengthening."""
    damping: Damping = 0.0
    """Force per rate of lengthening."""
    length: Annotated[float, Per("m", NOT_NEGATIVE)] = 0.0
    """Length at which it is relaxed."""


APPLIED = {"force": Force, "torque": Torque, "spring_damper": SpringDamper}


def _kind(value: Any) -> str:
    kind = value.get("type") if isinstance(value, dict) else getattr(value, "type", None)
    return f"·{kind}"


Applied = Annotated[
    Annotated[Force, Tag("·force")]
    | Annotated[Torque, Tag("·torque")]
    | Annotated[SpringDamper, Tag("·spring_damper")],
    Discriminator(_kind, custom_error_type="unknown_kind", custom_error_message="type: force, torque or spring_damper"),
]


@dataclass(frozen=True, config=STRICT)
class Input:
    """A named external input, whose value is given from outside during a run."""

    start: Number = 0.0
    """Value until someone sets it."""
    unit: str = "1"
    """Its unit (SI)."""
    description: str = ""
    """What it is, in words."""
    bandwidth: Annotated[float, Per("rad/s", POSITIVE)] = 100.0
    """How fast a motion that it prescribes follows it (critically damped, rad/s)."""
