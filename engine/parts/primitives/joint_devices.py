"""Primitives of devices along a freedom: springs, dampers, stops, latches, motors."""

from __future__ import annotations

from functools import cache
from typing import Any

import casadi as ca

from trunnion.parts.primitives.primitive_from_expressions import expression_primitive
from trunnion.parts.primitives.primitive_keys import ParameterCounter, Primitive
from trunnion.parts.primitives.primitive_symbols import PrimitiveSymbols
from trunnion.parts.primitives.signals_loads_energies import Timed
from trunnion.recursion import latch_forces
from trunnion.recursion.masses_and_forces import motor_force, stop_force, stop_push
from trunnion.recursion.vector_algebra import SX
from trunnion.system.structure.bodies_and_joints import Device, Latch, Motor, Signal, Stop

DEVICE = 7
"""Number of a device's parameters: stiffness and rest position of the spring, damping, stiffness and damping of the stops, lower
and upper end."""

LATCH = 6
"""Number of a latch's parameters: position, side, stiffness, damping, holding force, pitch of the teeth."""


@cache
def device(what: str) -> Primitive:
    """Primitive of a freedom's devices. Inputs: numbers (``DEVICE``), flags of the stops (2), coordinate, rate. The primitive
    adds one quantity (``what``) to the output: the ``force`` along the freedom, the ``power`` of dampers, or the ``potential``
    energy."""
    sym = Timed(DEVICE)
    q, rate = SX.sym("q"), SX.sym("rate")
    k, rest, damping, stiff, _, lower, upper = ca.vertsplit(sym.p)
    n = ParameterCounter().take(DEVICE)
    d = Device(stop=Stop(n[3], n[4], n[5], n[6], (0, 1)))
    elastic = sum((stiff * sym.flags[i] * (end - q) for i, end in enumerate((lower, upper))), SX(0))
    pressed = sum((0.5 * stiff * sym.flags[i] * (end - q) ** 2 for i, end in enumerate((lower, upper))), SX(0))
    out = {
        "force": -k * (q - rest) - damping * rate + stop_force(sym, d, q, rate),
        "power": -damping * rate**2 + (stop_force(sym, d, q, rate) - elastic) * rate,
        "potential": 0.5 * k * (q - rest) ** 2 + pressed,
    }[what]
    return expression_primitive(f"d_{what}", {"numbers": sym.p, "flags": sym.flags, "q": q, "rate": rate}, {"out": out}, ["out"])


@cache
def latch(what: str) -> Primitive:
    """The primitive of one quantity of a latch. what: ``force``, ``power`` (of damping), ``potential`` (energy) or ``depths``.

    ``depths`` has the inputs numbers (``LATCH``), flags (hook, pressed), coordinate and release; its outputs are three depths. The
    other quantities have the rate as an additional last input, and are added to the output."""
    sym, flags, q, rate, release = PrimitiveSymbols(LATCH), SX.sym("flags", 2), SX.sym("q"), SX.sym("rate"), SX.sym("release")
    n = ParameterCounter().take(LATCH)
    x: Any = Latch(n[0], sym.leaf(n[1]), n[2], n[3], n[4], Signal("value"), 0, 0, 0, n[5])  # type: ignore[arg-type]
    ins = {"numbers": sym.p, "flags": flags, "q": q}
    if what == "depths":
        found = latch_forces.depths(sym, x, flags[0], q, release)
        return expression_primitive("d_latch_depths", ins | {"release": release}, {"out": ca.vertcat(*found)})
    both = (flags[0], flags[1])
    force, stored = latch_forces.force(sym, x, both, q, rate), latch_forces.potential(sym, x, both, q)
    out = {"force": force, "power": (force - latch_forces.elastic(sym, x, both, q)) * rate, "potential": stored}
    return expression_primitive(f"d_latch_{what}", ins | {"rate": rate}, {"out": out[what]}, ["out"])


@cache
def motor() -> Primitive:
    """Primitive of a motor. Inputs: numbers (stall, no_load), signal, rate. The primitive adds the motor's effort to the output."""
    sym, signal, rate = PrimitiveSymbols(2), SX.sym("signal"), SX.sym("rate")
    stall, no_load = ParameterCounter().take(2)
    out = motor_force(sym, Motor(stall, no_load, Signal("value")), signal, rate)
    return expression_primitive("d_motor", {"numbers": sym.p, "signal": signal, "rate": rate}, {"out": out}, ["out"])


@cache
def depth(upper: bool) -> Primitive:
    """Primitive of an end stop. Inputs: end of the stop (1), coordinate. Output: depth by which the stop is compressed."""
    end, q = SX.sym("end"), SX.sym("q")
    return expression_primitive(
        f"d_depth_{'upper' if upper else 'lower'}", {"end": end, "q": q}, {"out": (-1 if upper else 1) * (end - q)}
    )


@cache
def push(upper: bool) -> Primitive:
    """Primitive of an end stop. Inputs: damping of the stop (1), rate. Output: factor of the stop's elastic force, which is 0 at
    release (``stop_push``)."""
    damping, rate = SX.sym("damping"), SX.sym("rate")
    out = stop_push(damping, -1 if upper else 1, rate)
    return expression_primitive(f"d_push_{'upper' if upper else 'lower'}", {"damping": damping, "rate": rate}, {"out": out})
