"""Shaft of a cylindrical joint (paper §7.2): two contacts at ∓c from the point of the part that has the ends, friction along and
around at once (METHOD, "Journal and shaft")."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from engine.basics.symbolic import SX, ca
from engine.contact.base import Contact, ContactElement, Hold, Wrench, ratio_held, while_sliding
from engine.contact.journal import (
    HALF_LENGTH,
    LENGTHS,
    PRELOAD,
    RADIUS,
    as_contacts,
    length,
    pair,
    pins,
    places,
    preloaded,
    pressed,
    spanned,
)
from engine.friction import Law

if TYPE_CHECKING:
    from engine.contact.resting import Pair, Rubs

TINY = 1e-300


def _needs(numbers: Sequence[str], adams: bool) -> tuple[str, ...]:
    return ("f2", "f3") if adams else spanned(("f2", "f3", "m2", "m3"), numbers)


def _velocity(rates: list[SX], g: Mapping[str, SX]) -> list[list[SX]]:
    return [[rates[0], g["radius"] * rates[1]]]


def _ratios(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX]) -> tuple[SX, SX]:
    ks, kr = laws[0].ratios(_velocity(rates, g)[0], (1.0, g["radius"]))
    return w.pin * ks, w.pin * kr


def _friction(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    """Friction force (125) and torque (126): k_s Σf and k_r r Σf; in Adams' form with the force across the axis for Σf."""
    ks, kr = _ratios(w, rates, laws, g)
    load = _load(w, ks, kr, g, adams)
    return [w.pin * ks * load, w.pin * kr * g["radius"] * load]


def _load(w: Wrench, ks: SX, kr: SX, g: Mapping[str, SX], adams: bool) -> SX:
    """What friction is proportional to: f_1 + f_2 and a preload; in Adams' form the force across the axis for f_1 + f_2."""
    if adams:
        return preloaded(length(w["f2"], w["f3"]), g)
    a1, b1, a2, b2 = pair(w, kr, ks, g)
    return preloaded(length(a1, b1) + length(a2, b2), g)


def _direction(w: Wrench, u: list[SX], g: Mapping[str, SX]) -> tuple[SX, SX, SX]:
    """Size of a friction u = (force, torque) as a force at the surface, N, and the direction in which k_s, k_r then point (a unit
    vector)."""
    along, around = u[0], u[1] / g["radius"]
    size = length(along, around)
    return size, w.pin * along / size, w.pin * around / size


def _held(w: Wrench, u: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[Hold]:
    """κ · load(κ) grows with κ along a direction, so that its value at μ_static is the capacity (METHOD, "Rest")."""
    size, ds, dr = _direction(w, u, g)
    most = laws[0].static
    return [Hold(most * _load(w, most * ds, most * dr, g, adams), size - math.sqrt(TINY))]  # a shaft without load holds 0


def _contacts(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[Contact]:
    ks, kr = _ratios(w, rates, laws, g)
    if laws[0].sets:
        size, ds, dr = _direction(w, eta, g)
        still = ratio_held(lambda k: _load(w, k * ds, k * dr, g, False), size)
        ks, kr = ca.if_else(laws[0].stuck, still * ds, ks), ca.if_else(laws[0].stuck, still * dr, kr)
    return as_contacts(*pair(w, kr, ks, g))


def _pressed(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX]) -> list[SX]:
    ks, kr = (while_sliding(laws[0], k) for k in _ratios(w, rates, laws, g)) if laws else (ca.SX(0), ca.SX(0))
    return pressed(w, kr, ks, g)


def _speeds(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    v, u = _velocity(rates, g)[0]
    return [ca.sqrt(v * v + u * u + TINY) * laws[0].sign([v, u], (1.0, g["radius"]))]


def _rests(j: Rubs) -> list[Pair]:
    """An upper bound: with k_s, the axial part of friction, Y = Y_0 + β F with |β| ≤ μ r/c, so that each |F ± Y| is at most
    |F ± Y_0| + |β||F|. Against a given direction β is known."""
    import numpy as np

    from engine.contact.resting import Capacity, Norm, Pair, ends_of, preload, sine, static, whole

    mu, r = static(j), j.sizes["radius"]
    if j.adams:
        held, along = Capacity((Norm(whole(j, ("f2", "f3")), mu), *preload(j, mu))), None
    else:
        c, across = j.sizes["half_length"], whole(j, ("f3", "f2"))
        ends = ends_of(j, ("f2", "f3"), ("m2", "m3"), c, mu)
        loose = tuple(replace(n, weight=0.5 * mu) for n in ends)
        least = (0.5 * sine(mu),) * 2 + (-sine(mu) * mu * r / c,) + tuple(n.weight for n in preload(j, mu))
        held = Capacity((*loose, Norm(across, mu * mu * r / c, 0.0), *preload(j, mu)), 0, False, least)

        def along(d: np.ndarray) -> Capacity:
            ks, kr = mu * j.sense * d
            beta = ks * r / c * (1 - 1j * kr) / (1 + kr * kr)
            turned = np.array([[beta.real, -beta.imag], [beta.imag, beta.real]]) @ across
            weight = 0.5 * mu / float(np.hypot(1.0, kr))
            both = (Norm(n.rows + s * turned, weight, 0.5) for n, s in zip(ends, (1.0, -1.0), strict=True))
            return Capacity((*both, *preload(j, mu)))

    return [Pair(j.joint, 1, j.eta, np.diag([1.0, 1.0 / r]), (held,), mu, along=along)]


SHAFT = ContactElement(
    "shaft", _needs, _friction, _speeds, _held, _contacts, _velocity, _pressed,
    2, springs=4,
    rests=_rests, sizes=(RADIUS, HALF_LENGTH, *LENGTHS, PRELOAD), pairs=((0, 1),), places=places, pins=pins,
)  # fmt: skip
