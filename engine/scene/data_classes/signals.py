"""Functions of time in a scene (constant, ramp, harmonic, table, external input), and the devices that use them. They are
data, never code."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Strict, Tag
from pydantic.dataclasses import dataclass

from trunnion.basics.number_declarations import POSITIVE, Bound
from trunnion.scene.data_classes.field_types import SCALAR, STRICT
from trunnion.scene.units.quantities import Angle, AnyUnit, Duration, NotNegative, Number, Per, Positive, Time


@dataclass(frozen=True, config=STRICT)
class Constant:
    """Constant rate of a drive: q = start + rate t."""

    rate: Number
    """Rate of the coordinate."""
    start: Number = 0.0
    """Coordinate at t = 0."""


@dataclass(frozen=True, config=STRICT)
class Ramp:
    """A linear change from ``start`` to ``end`` between ``begin`` and ``begin + duration``. For a load, the value changes; for a
    drive, the rate (with q = origin at t = 0)."""

    start: Number
    """Value (drives: rate) before ``begin``."""
    end: Number
    """Value (drives: rate) from ``begin + duration`` on."""
    duration: Duration
    """Duration of the change."""
    begin: Time = 0.0
    """Time at which the change begins."""
    origin: Number = 0.0
    """Drives only: coordinate at t = 0."""


@dataclass(frozen=True, config=STRICT)
class Move:
    """A motion of a drive from rest to rest: q = ``start`` until ``begin``, and q = ``end`` from ``begin + duration`` on."""

    start: Number
    """Coordinate before the motion."""
    end: Number
    """Coordinate after the motion."""
    duration: Annotated[float, Per("s", Bound(0.0, open=True, advice="a motion needs a positive duration"))]
    """Duration of the motion."""
    begin: Time = 0.0
    """Time at which the motion begins."""
    profile: Literal["polynomial", "trapezoid", "s_curve"] = "polynomial"
    """polynomial: degree 5, zero acceleration at the ends; trapezoid: constant acceleration, constant rate, constant
    deceleration, a third of the time each; s_curve: as trapezoid, with limited jerk."""


@dataclass(frozen=True, config=STRICT)
class Harmonic:
    """A sine: offset + amplitude sin(2 pi frequency t + phase)."""

    amplitude: Number
    """Amplitude, half of the peak-to-peak value."""
    frequency: Annotated[float, Per("Hz", Bound(0.0, advice="for the opposite sign, add 180 deg to the phase"))]
    """Cycles per second."""
    phase: Angle = 0.0
    """Phase at t = 0."""
    offset: Number = 0.0
    """Mean value."""


Interpolation = Literal["natural", "clamped", "monotone", "linear"]


@dataclass(frozen=True, config=STRICT)
class Table:
    """A curve through values at given times. Outside the table, drives continue at constant rate and loads keep their value."""

    time: tuple[Time, ...]
    """At least two increasing times."""
    value: tuple[Number, ...]
    """One value for each time."""
    interpolation: Interpolation | None = None
    """natural: cubic spline with zero second derivative at its ends. clamped: cubic spline with the rates ``end_rates`` at its
    ends. monotone: cubic pieces, monotone between any two values (the second derivative jumps at the times). linear: straight
    lines, for loads only. Default: natural for drives, linear for loads."""
    end_rates: tuple[Number, Number] | None = None
    """With interpolation clamped: rate at the first and at the last time; default: zero."""


@dataclass(frozen=True, config=STRICT)
class InputCurve:
    """A smooth function of an input, monotone between any two values. Beyond its ends it is constant."""

    at: tuple[Number, ...]
    """Two to twelve increasing values of the input, in its SI unit."""
    value: tuple[Number, ...]
    """One value for each entry of ``at``."""


@dataclass(frozen=True, config=STRICT)
class FromInput:
    """A number that equals a named external input of the scene, or is a function of the input."""

    input: str
    """Name of the input."""
    curve: InputCurve | None = None
    """A function of the input, for example the coefficient of friction over the temperature."""


@dataclass(frozen=True, config=STRICT)
class BySpeed:
    """A measured coefficient of friction over the sliding speed: a smooth curve, monotone between any two values. Beyond the
    last speed it is constant."""

    speed: tuple[Annotated[float, Per("m/s", Bound(0.0))], ...]
    """Two to twelve increasing sliding speeds. The first is 0; its coefficient is that of static friction."""
    value: tuple[Annotated[float, Per("1", Bound(0.0))], ...]
    """One coefficient for each speed."""


@dataclass(frozen=True, config=STRICT)
class Drive:
    """Prescribed motion of one joint coordinate, by exactly one of these kinds. The required effort is an output."""

    constant: Constant | None = None
    """Constant rate."""
    ramp: Ramp | None = None
    """Rate that changes linearly from one value to another."""
    move: Move | None = None
    """Motion from one coordinate to another, at rest before and after."""
    harmonic: Harmonic | None = None
    """Sine motion."""
    table: Table | None = None
    """Curve through values at times."""
    input: str | None = None
    """Name of an external input; the motion follows the input through a filter (see its bandwidth)."""


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
    """A discriminator for the forms of a load (number, input, signal) and lists of loads; ``wanted`` names the allowed forms in
    errors."""
    return Discriminator(_load_form, custom_error_type="wrong_form", custom_error_message=wanted)


Load = Annotated[
    Annotated[Number, SCALAR] | Annotated[FromInput, Tag("·input")] | Annotated[Signal, Tag("·signal")],
    load_or("a number, an input or a signal (ramp, harmonic, table)"),
]
"""A load: a constant, an external input, or a function of time."""
LoadVector = tuple[Load, Load, Load]


@dataclass(frozen=True, config=STRICT)
class Motor:
    """A motor with a linear torque-speed characteristic: torque (or force) = stall (signal − rate/no_load)."""

    stall: Annotated[float, AnyUnit(bound=POSITIVE)]
    """Torque or force at rest, at a signal of 1."""
    no_load: Annotated[float, AnyUnit(bound=POSITIVE)]
    """Rate at which torque or force is zero, at a signal of 1."""
    signal: Load = 1.0
    """Fraction of its full voltage, from -1 to 1: a number, an input or a signal. At 0 the terminals are shorted, and the motor
    brakes."""


@dataclass(frozen=True, config=STRICT)
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
    down: Annotated[bool, Strict()] = False
    """true: the hook is down at the start, even if the part presses into the hook (a ratchet: on its first tooth). false: the hook
    is down only if the part is already on the kept side."""
