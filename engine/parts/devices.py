"""Parts of what acts along a freedom: springs, dampers, stops, latches, motors."""

from __future__ import annotations

from functools import cache
from typing import Any

import casadi as ca

from engine.parts.known import Numbers, Part
from engine.parts.local import PartSymbols
from engine.parts.one import one
from engine.parts.small import Timed
from engine.recursion import latches
from engine.recursion.loads import motor_force, stop_force, stop_push
from engine.recursion.vectors import SX
from engine.system.structure import Device, Latch, Motor, Signal, Stop

DEVICE = 7
"""Numbers of a device: stiffness and rest of its spring, damping, stiffness and damping of its stops, lower and upper end."""

LATCH = 6
"""Numbers of a latch: where it is, its side, stiffness, damping, what it holds, pitch of its teeth."""


@cache
def device(what: str) -> Part:
    """numbers (``DEVICE``), flags of the stops (2), coordinate, rate → ``force`` along the freedom, ``power`` of what takes energy
    and ``potential`` energy; each is added."""
    sym = Timed(DEVICE)
    q, rate = SX.sym("q"), SX.sym("rate")
    k, rest, damping, stiff, _, lower, upper = ca.vertsplit(sym.p)
    n = Numbers().some(DEVICE)
    d = Device(stop=Stop(n[3], n[4], n[5], n[6], (0, 1)))
    elastic = sum((stiff * sym.flags[i] * (end - q) for i, end in enumerate((lower, upper))), SX(0))
    pressed = sum((0.5 * stiff * sym.flags[i] * (end - q) ** 2 for i, end in enumerate((lower, upper))), SX(0))
    out = {
        "force": -k * (q - rest) - damping * rate + stop_force(sym, d, q, rate),
        "power": -damping * rate**2 + (stop_force(sym, d, q, rate) - elastic) * rate,
        "potential": 0.5 * k * (q - rest) ** 2 + pressed,
    }[what]
    return one(f"d_{what}", {"numbers": sym.p, "flags": sym.flags, "q": q, "rate": rate}, {"out": out}, ["out"])


@cache
def latch(what: str) -> Part:
    """Of a latch: numbers (``LATCH``), flags (hook, pressed), coordinate, rate → ``force``, ``power`` of
    its damping or ``potential`` energy, added; or from hook, coordinate and release its ``depths`` (2)."""
    sym, flags, q, rate, release = PartSymbols(LATCH), SX.sym("flags", 2), SX.sym("q"), SX.sym("rate"), SX.sym("release")
    n = Numbers().some(LATCH)
    x: Any = Latch(n[0], sym.leaf(n[1]), n[2], n[3], n[4], Signal("value"), 0, 0, 0, n[5])  # type: ignore[arg-type]
    ins = {"numbers": sym.p, "flags": flags, "q": q}
    if what == "depths":
        found = latches.depths(sym, x, flags[0], q, release)
        return one("d_latch_depths", ins | {"release": release}, {"out": ca.vertcat(*found)})
    both = (flags[0], flags[1])
    force, stored = latches.force(sym, x, both, q, rate), latches.potential(sym, x, both, q)
    out = {"force": force, "power": (force - latches.elastic(sym, x, both, q)) * rate, "potential": stored}
    return one(f"d_latch_{what}", ins | {"rate": rate}, {"out": out[what]}, ["out"])


@cache
def motor() -> Part:
    """numbers (stall, no_load), signal, rate → effort of a motor, added."""
    sym, signal, rate = PartSymbols(2), SX.sym("signal"), SX.sym("rate")
    stall, no_load = Numbers().some(2)
    out = motor_force(sym, Motor(stall, no_load, Signal("value")), signal, rate)
    return one("d_motor", {"numbers": sym.p, "signal": signal, "rate": rate}, {"out": out}, ["out"])


@cache
def depth(upper: bool) -> Part:
    """End of a stop (1), coordinate → by how much it is pressed."""
    end, q = SX.sym("end"), SX.sym("q")
    return one(f"d_depth_{'upper' if upper else 'lower'}", {"end": end, "q": q}, {"out": (-1 if upper else 1) * (end - q)})


@cache
def push(upper: bool) -> Part:
    """Damping of a stop (1), rate → how far it is from letting go (``stop_push``)."""
    damping, rate = SX.sym("damping"), SX.sym("rate")
    out = stop_push(damping, -1 if upper else 1, rate)
    return one(f"d_push_{'upper' if upper else 'lower'}", {"damping": damping, "rate": rate}, {"out": out})
