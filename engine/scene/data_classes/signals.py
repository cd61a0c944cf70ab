"""Functions of time in a scene: given as data (constant, ramp, harmonic, table, external input), never as code;
and devices that follow them."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Strict, Tag
from pydantic.dataclasses import dataclass

from trunnion.basics.number_declarations import POSITIVE, Bound
from trunnion.scene.data_classes.field_types import SCALAR, STRICT
from trunnion.scene.units.quantities import Angle, AnyUnit, Duration, NotNegative, Number, Per, Positive, Time


@dataclass(frozen=True, config=STRICT)
class Constant:
    """Steady rate of a drive: q = start + rate t."""

    rate: Number
    """Rate of the coordinate."""
    start: Number = 0.0
    """Coordinate at t = 0."""


@dataclass(frozen=True, config=STRICT)
class Ramp:
    """A linear change from ``start`` to ``end`` between ``begin`` and ``begin + duration``. The value of a load changes, or the
    rate of a drive (with q = origin at t = 0)."""

    start: Number
    """Value (drives: rate) before ``begin``."""
    end: Number
    """Value (drives: rate) from ``begin + duration`` on."""
    duration: Duration
    """How long the change takes."""
    begin: Time = 0.0
    """When the change begins."""
    origin: Number = 0.0
    """Drives only: coordinate at t = 0."""


@dataclass(frozen=True, config=STRICT)
class Move:
    """A way from rest to rest of a drive: at ``start`` up to ``begin``, at ``end`` from ``begin + duration`` on."""

    start: Number
    """Coordinate before."""
    end: Number
    """Coordinate after."""
    duration: Annotated[float, Per("s", Bound(0.0, open=True, advice="a way takes some time"))]
    """How long it takes."""
    begin: Time = 0.0
    """When it begins."""
    profile: Literal["polynomial", "trapezoid", "s_curve"] = "polynomial"
    """polynomial: of degree 5, no acceleration at its ends; trapezoid: speed up, go on, slow down, a third of the time each;
    s_curve: the same with limited jerk."""


@dataclass(frozen=True, config=STRICT)
class Harmonic:
    """A sine: offset + amplitude sin(2 pi frequency t + phase)."""

    amplitude: Number
    """Half the swing."""
    frequency: Annotated[float, Per("Hz", Bound(0.0, advice="turn the phase instead"))]
    """Cycles per second."""
    phase: Angle = 0.0
    """Phase at t = 0."""
    offset: Number = 0.0
    """Mean value."""


Interpolation = Literal["natural", "clamped", "monotone", "linear"]


@dataclass(frozen=True, config=STRICT)
class Table:
    """Values at times and a curve through them. Before and after, drives go straight on and loads keep their value."""

    time: tuple[Time, ...]
    """Increasing times, two at least."""
    value: tuple[Number, ...]
    """One value for each time."""
    interpolation: Interpolation | None = None
    """natural: cubic spline without curvature at its ends (so that it may begin with a rate); clamped: cubic spline with given
    rates at its ends, zero if none are given; monotone: cubic pieces that rise and fall only where the values do and rest where
    they rest (accelerations jump at the times); linear: straight lines, for loads only. Not given: natural for drives, linear
    for loads."""
    end_rates: tuple[Number, Number] | None = None
    """With interpolation clamped: rate at the first and at the last time."""


@dataclass(frozen=True, config=STRICT)
class InputCurve:
    """A smooth function of an input, which rises and falls only where the values do. The end values continue."""

    at: tuple[Number, ...]
    """Increasing values of the input, in its SI unit, two to twelve."""
    value: tuple[Number, ...]
    """One value for each."""


@dataclass(frozen=True, config=STRICT)
class FromInput:
    """A number that is the scene's named external input, or follows from it."""

    input: str
    """Name of the input."""
    curve: InputCurve | None = None
    """A function of the input, such as a coefficient of friction by temperature."""


@dataclass(frozen=True, config=STRICT)
class BySpeed:
    """A measured coefficient of friction by the sliding speed: a smooth curve that rises and falls only where the values do. The
    last value continues."""

    speed: tuple[Annotated[float, Per("m/s", Bound(0.0))], ...]
    """Increasing sliding speeds, of which the first is 0 (there the coefficient is that of rest), two to twelve."""
    value: tuple[Annotated[float, Per("1", Bound(0.0))], ...]
    """One coefficient for each."""


@dataclass(frozen=True, config=STRICT)
class Drive:
    """Prescribed motion of one joint coordinate, by exactly one of these kinds. The effort it takes is an output."""

    constant: Constant | None = None
    """Steady rate."""
    ramp: Ramp | None = None
    """Rate that changes linearly from one value to another."""
    move: Move | None = None
    """From one coordinate to another, at rest before and after."""
    harmonic: Harmonic | None = None
    """Sine motion."""
    table: Table | None = None
    """Curve through values at times."""
    input: str | None = None
    """The scene's named external input; the motion follows it smoothly (see its bandwidth)."""


@dataclass(frozen=True, config=STRICT)
class Signal:
    """A load that changes with time, by exactly one of these kinds (a constant load is written as a plain number)."""

    ramp: Ramp | None = None
    """Linear change from one value to another."""
    harmonic: Harmonic | None = None
    """Sine."""
    table: Table | None = None
    """Curve through values at times."""


def _load_form(value: Any) -> str:
    if isinstance(value, FromInput) or (isinstance(value, dict) and "input" in value):
        return "·input"
    if isinstance(value, BySpeed) or (isinstance(value, dict) and "speed" in value):
        return "·speed"
    if isinstance(value, dict | Signal):
        return "·signal"
    return "·list" if isinstance(value, list | tuple) else SCALAR.tag


def load_or(wanted: str) -> Discriminator:
    """A discriminator that chooses among the forms of a load (number, input, signal) and lists of them; ``wanted`` names them
    in errors."""
    return Discriminator(_load_form, custom_error_type="wrong_form", custom_error_message=wanted)


Load = Annotated[
    Annotated[Number, SCALAR] | Annotated[FromInput, Tag("·input")] | Annotated[Signal, Tag("·signal")],
    load_or("a number, an input or a signal (ramp, harmonic, table)"),
]
"""A load: a constant, an external input, or a function of time."""
LoadVector = tuple[Load, Load, Load]


@dataclass(frozen=True, config=STRICT)
class Motor:
    """A motor by its line of torque over speed: stall (signal − rate/no_load), a force where the freedom slides."""

    stall: Annotated[float, AnyUnit(bound=POSITIVE)]
    """Torque or force at rest, at a signal of 1."""
    no_load: Annotated[float, AnyUnit(bound=POSITIVE)]
    """Rate at which it gives none, at a signal of 1."""
    signal: Load = 1.0
    """Part of its full voltage, from -1 to 1: a number, an input or a signal; at 0 its terminals are shorted, and it brakes."""


@dataclass(frozen=True, config=STRICT)
class Latch:
    """A hook that falls behind a passing part and then holds it like an end stop. Falling takes no force."""

    at: Number
    """Coordinate at which it falls, and below (or above) which it does not let back."""
    stiffness: Positive
    """N/m, or N*m/rad."""
    keeps: Literal["above", "below"] = "above"
    """On which side it keeps what it has caught."""
    damping: NotNegative = 0.0
    """s/m, or s/rad."""
    release: Load = 0.0
    """Lifted while this is above 0.5: an input or a signal."""
    holds: Positive | None = None
    """Force or torque at which it lets go; default: it holds anything."""
    pitch: Positive | None = None
    """Distance of the teeth of a ratchet, m or rad: it falls behind each that passes, the first being where it is said to be."""
    down: Annotated[bool, Strict()] = False
    """Whether it is down from the start, also where what it keeps presses it in there (of a ratchet on its first tooth); else it is
    where that is behind it."""
