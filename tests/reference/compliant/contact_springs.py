"""Contacts of joints as springs with friction, for many states and joints at once: forces on the pin, in its frame.

A contact presses with the force k u. The number u is the displacement of the bearing against the pin at the contact, plus a share
of its rate. Friction at a contact is the law's slope times normal force times velocity of the bearing on the pin's surface. The
definitions are the same as in ``contact_and_friction.contact_roots``; in this module the springs give the normal force, so that no
equation has to be solved.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.reference.compliant.positions_and_rates import cross, dot

SHARP = 1e-300


@dataclass
class RelativeMotion:
    """Motion of bearings relative to pins, in the pins' frames. x, turn: displacements plus a share of their rates. slide, spin:
    rates. ends: position of the ends' point along the axis, measured from the bearing's point."""

    t: np.ndarray
    x: np.ndarray
    turn: np.ndarray
    slide: np.ndarray
    spin: np.ndarray
    ends: np.ndarray


@dataclass
class Wrench:
    """Force and torque on pins, about the bearing's point, and the power that friction takes, W."""

    force: np.ndarray
    torque: np.ndarray
    taken: np.ndarray


def _zeros(s: RelativeMotion) -> Wrench:
    return Wrench(np.zeros_like(s.x), np.zeros_like(s.x), np.zeros(s.x.shape[:-1]))


def shaft(s: RelativeMotion, k, size, slope) -> Wrench:
    """Two lateral contacts at the ends. ``slope(speed)``; size: radius, half length, preload; thrust radius of a journal."""
    out, r = _zeros(s), size["radius"]
    way, rate = s.slide[..., 0] * size["slides"], s.spin[..., 0]
    grip = slope(np.hypot(way, r * rate))
    load = size["preload"](s.t)
    for side in (-1.0, 1.0):
        at = s.ends + side * size["half_length"]
        N = np.zeros_like(s.x)
        N[..., 1], N[..., 2] = k * (s.x[..., 1] + s.turn[..., 2] * at), k * (s.x[..., 2] - s.turn[..., 1] * at)
        f = np.sqrt(dot(N, N) + SHARP)
        load = load + f
        around = np.stack([np.zeros_like(f), -N[..., 2], N[..., 1]], axis=-1)  # e1 x N
        F = N - (grip * rate * r)[..., None] * around
        out.force += F
        out.torque[..., 1] -= at * F[..., 2]
        out.torque[..., 2] += at * F[..., 1]
        out.torque += (grip * r * way)[..., None] * around
    out.force[..., 0] += grip * way * load
    axial = k * s.x[..., 0] * (1 - size["slides"])
    out.force[..., 0] += axial
    torque = grip * r * rate * (r * load + size["thrust_radius"] * np.abs(axial))
    out.torque[..., 0] += torque
    out.taken = grip * way**2 * load + torque * rate
    return out


def sleeve(s: RelativeMotion, k, size, slope) -> Wrench:
    """A rectangular sleeve. Its ends press along e2 and e3, and the torsion is a couple at the longer arm."""
    out, way = _zeros(s), s.slide[..., 0]
    grip = slope(np.abs(way)) * way
    load = size["preload"](s.t)
    for side in (-1.0, 1.0):
        at = s.ends + side * size["half_length"]
        wide, high = k * (s.x[..., 1] + s.turn[..., 2] * at), k * (s.x[..., 2] - s.turn[..., 1] * at)
        out.force[..., 1] += wide
        out.force[..., 2] += high
        out.torque[..., 2] += at * wide + size["half_width"] * wide * grip
        out.torque[..., 1] -= at * high + size["half_height"] * high * grip
        load = load + np.abs(wide) + np.abs(high)
    arm = np.maximum(size["half_width"], size["half_height"])
    couple = k * arm * s.turn[..., 0]
    out.torque[..., 0] += couple * arm
    load = load + np.abs(couple)
    out.force[..., 0] += grip * load
    out.taken = grip * way * load
    return out


def ball(s: RelativeMotion, k, size, slope) -> Wrench:
    """One contact. ``slope`` is a function of the speed at the contact."""
    out, r = _zeros(s), size["radius"]
    N = k[..., None] * s.x
    f = np.sqrt(dot(N, N) + SHARP)
    across = cross(s.spin, N)
    speed = r * np.sqrt(dot(across, across)) / f
    grip = slope(speed)
    out.force = N - (grip * r)[..., None] * across
    out.torque = (grip * r * r / f)[..., None] * cross(N, cross(s.spin, N))
    out.taken = grip * f * speed**2
    return out


def given(s: RelativeMotion, size, slope_turn, slope_way, forward) -> Wrench:
    """Friction of a given size, about and along the axis. ``forward`` is +1 if the pin is inboard, else -1."""
    out, way, rate = _zeros(s), s.slide[..., 0], s.spin[..., 0]
    T = np.where(rate * forward >= 0, size["torque"](s.t), size["back_torque"](s.t))
    F = np.where(way * forward >= 0, size["force"](s.t), size["back_force"](s.t))
    out.torque[..., 0] = slope_turn(np.abs(rate)) * rate * T
    out.force[..., 0] = slope_way(np.abs(way)) * way * F
    out.taken = out.torque[..., 0] * rate + out.force[..., 0] * way
    return out
