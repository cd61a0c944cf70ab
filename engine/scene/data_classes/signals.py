"""Functions of time in a scene (``trunnion.scene.signals``, external inputs), and the devices that use them. Functions of time are
data, never code."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

from trunnion.basics.lazy_data_classes import validated
from trunnion.basics.number_declarations import POSITIVE, Bound
from trunnion.scene.data_classes.field_types import SCALAR, STRICT, Discriminator, Exactly, Field, Tag, with_fields
from trunnion.scene.signals.limit import Limit
from trunnion.scene.signals.registry import DRIVES, LOADS, REGISTRY
from trunnion.scene.units.numbers_with_units import AnyUnit, NotNegative, Number, Per, Positive


@validated(frozen=True, config=STRICT)
class InputCurve:
    """A smooth function of an input, monotone between any two values. The function is constant beyond its ends."""

    at: tuple[Number, ...]
    """Two to twelve increasing values of the input, in its SI unit."""
    value: tuple[Number, ...]
    """One value for each entry of ``at``."""


@validated(frozen=True, config=STRICT)
class FromInput:
    """A number that equals a named external input of the scene, or is a function of the input."""

    input: str
    """Name of the input."""
    curve: InputCurve | None = None
    """A function of the input, for example the coefficient of friction over the temperature."""


@validated(frozen=True, config=STRICT)
class BySpeed:
    """A measured coefficient of friction over the sliding speed: a smooth curve, monotone between any two values. The curve is
    constant beyond the last speed."""

    speed: tuple[Annotated[float, Per("m/s", Bound(0.0))], ...]
    """Two to twelve increasing sliding speeds. The first is 0; its coefficient is the coefficient of static friction."""
    value: tuple[Annotated[float, Per("1", Bound(0.0))], ...]
    """One coefficient for each speed."""


@validated(frozen=True, config=STRICT)
class ByLoad:
    """An efficiency over the torque or over the speed of the output shaft: a smooth curve, monotone between any two values. The
    curve is constant beyond its ends."""

    value: tuple[Annotated[float, Per("1", Bound(0.0, 1.0))], ...]
    """One efficiency for each torque or speed."""
    torque: tuple[Annotated[float, Per("N*m", Bound(0.0))], ...] | None = None
    """Two to twelve increasing torques on the output shaft."""
    speed: tuple[Annotated[float, Per("rad/s", Bound(0.0))], ...] | None = None
    """Two to twelve increasing speeds of the output shaft, instead of torques."""


def _kinds(keys: tuple[str, ...]) -> list[Field]:
    return [(key, REGISTRY[key].data | None, None, REGISTRY[key].text) for key in keys]


@validated(frozen=True, config=STRICT)
@with_fields(_kinds(DRIVES))
class Drive:
    """Prescribed motion of one joint coordinate, by exactly one of these kinds. The required effort is an output."""

    input: str | None = None
    """Name of an external input; the motion follows the input through a filter (see its bandwidth)."""

    if TYPE_CHECKING:

        def __init__(self, *given: Any, **by_key: Any): ...


@validated(frozen=True, config=STRICT)
@with_fields(_kinds(LOADS))
class Signal:
    """A load that changes with time, by exactly one of these kinds (a constant load is written as a plain number)."""

    limit: Limit | None = None
    """Limits of the signal's value."""

    if TYPE_CHECKING:

        def __init__(self, *given: Any, **by_key: Any): ...


def _load_form(value: Any) -> str:
    if isinstance(value, FromInput) or (isinstance(value, dict) and "input" in value):
        return "·input"
    if isinstance(value, BySpeed) or (isinstance(value, dict) and "speed" in value):
        return "·speed"
    if isinstance(value, dict | Signal):
        return "·signal"
    return "·list" if isinstance(value, list | tuple) else SCALAR.tag


VARYING_FORMS = f"an input or a signal ({', '.join(LOADS)})"
"""The forms of a load that varies, in words."""


def load_or(wanted: str) -> Discriminator:
    """A discriminator for the forms of a load (number, input, signal) and lists of loads; ``wanted`` names the allowed forms in
    errors."""
    return Discriminator(_load_form, custom_error_type="wrong_form", custom_error_message=wanted)


Load = Annotated[
    Annotated[Number, SCALAR] | Annotated[FromInput, Tag("·input")] | Annotated[Signal, Tag("·signal")],
    load_or(f"a number, {VARYING_FORMS}"),
]
"""A load: a constant, an external input, or a function of time."""
LoadVector = tuple[Load, Load, Load]


@validated(frozen=True, config=STRICT)
class Motor:
    """A motor with a linear torque-speed characteristic: torque (or force) = stall (signal − rate/no_load)."""

    stall: Annotated[float, AnyUnit(bound=POSITIVE)]
    """Torque or force at rest, at a signal of 1."""
    no_load: Annotated[float, AnyUnit(bound=POSITIVE)]
    """Rate at which torque or force is zero, at a signal of 1."""
    signal: Load = 1.0
    """Fraction of the motor's full voltage, from -1 to 1: a number, an input or a signal. At 0 the terminals are shorted, and the
    motor brakes."""


@validated(frozen=True, config=STRICT)
class Latch:
    """A hook that falls behind a passing part and then holds the part like an end stop. No force is needed to make the hook
    fall."""

    at: Number
    """Coordinate at which the hook falls; the fallen hook prevents a return beyond this coordinate."""
    stiffness: Positive
    """N/m, or N*m/rad."""
    keeps: Literal["above", "below"] = "above"
    """Side of ``at`` on which the hook keeps the coordinate."""
    damping: NotNegative = 0.0
    """s/m, or s/rad."""
    release: Load = 0.0
    """The hook is lifted while this input or signal is above 0.5."""
    holds: Positive | None = None
    """Force or torque at which the hook releases; default: no limit."""
    pitch: Positive | None = None
    """Distance between the teeth of a ratchet, m or rad. The pawl falls behind each passing tooth; the first tooth is ``at``."""
    down: Annotated[bool, Exactly()] = False
    """true: the hook is down at the start, even if the part presses into the hook (a ratchet: on its first tooth). false: the hook
    is down only if the part is already on the kept side."""
