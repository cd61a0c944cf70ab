"""Shaft of a cylindrical joint (paper §7.2): two contacts along the axis, at −c and +c from the joint's point on the part that
``ends`` names. Friction along and around the shaft forms one friction pair (theory, "Journal and shaft")."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.elements.contact.clearance import Play
from trunnion.elements.contact.contact_element import TINY, Contact, ContactElement, Hold, Wrench, ratio_held
from trunnion.elements.contact.journal import (
    HALF_LENGTH,
    LENGTHS,
    PRELOAD,
    RADIUS,
    as_contacts,
    length,
    pair,
    pins,
    places,
    pressed,
    with_preload,
    with_span,
)
from trunnion.elements.friction import Law

if TYPE_CHECKING:
    from trunnion.elements.contact.static_friction_capacity import Pair, Rubs


def _needs(numbers: Sequence[str], adams: bool) -> tuple[str, ...]:
    return ("f2", "f3") if adams else with_span(("f2", "f3", "m2", "m3"), numbers)


def _velocity(rates: list[SX], g: Mapping[str, SX]) -> list[list[SX]]:
    return [[rates[0], g["radius"] * rates[1]]]


def _ratios(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX]) -> tuple[SX, SX]:
    ks, kr = laws[0].ratios(_velocity(rates, g)[0], (1.0, g["radius"]))
    return w.pin * ks, w.pin * kr


def _friction(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    """Friction force (125) and torque (126): k_s Σf and k_r r Σf, with the sum Σf of the normal forces. In Adams' form, Σf is the
    force normal to the axis."""
    ks, kr = _ratios(w, rates, laws, g)
    load = _load(w, ks, kr, g, adams)
    return [w.pin * ks * load, w.pin * kr * g["radius"] * load]


def _load(w: Wrench, ks: SX, kr: SX, g: Mapping[str, SX], adams: bool) -> SX:
    """Load to which friction is proportional: f_1 + f_2 + preload. In Adams' form, the force normal to the axis replaces f_1 +
    f_2."""
    if adams:
        return with_preload(length(w["f2"], w["f3"]), g)
    a1, b1, a2, b2 = pair(w, kr, ks, g)
    return with_preload(length(a1, b1) + length(a2, b2), g)


def _direction(w: Wrench, u: list[SX], g: Mapping[str, SX]) -> tuple[SX, SX, SX]:
    """Norm of the friction u = (force, torque) as a force at the surface, N, and the two components of its unit vector along (k_s,
    k_r)."""
    along, around = u[0], u[1] / g["radius"]
    size = length(along, around)
    return size, w.pin * along / size, w.pin * around / size


def _held(w: Wrench, u: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[Hold]:
    """Let κ = |(k_s, k_r)|. The capacity is κ · load(κ) at κ = μ_static, because this product increases with κ for a fixed
    direction (theory, "Rest")."""
    size, ds, dr = _direction(w, u, g)
    most = laws[0].static
    return [Hold(most * _load(w, most * ds, most * dr, g, adams), size - math.sqrt(TINY))]  # the size is exactly 0 for u = 0


def _ratios_now(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> tuple[SX, SX]:
    """Friction ratios of a sliding pair, or of a pair at rest with the friction η."""
    ks, kr = _ratios(w, rates, laws, g)
    if not (laws[0].sets and eta):
        return ks, kr
    size, ds, dr = _direction(w, eta, g)
    still = ratio_held(lambda k: _load(w, k * ds, k * dr, g, False), size, laws[0].static)
    return ca.if_else(laws[0].stuck, still * ds, ks), ca.if_else(laws[0].stuck, still * dr, kr)


def _contacts(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[Contact]:
    ks, kr = _ratios_now(w, rates, laws, g, eta)
    return as_contacts(*pair(w, kr, ks, g))


def _pressed(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[SX]:
    ks, kr = _ratios_now(w, rates, laws, g, eta) if laws else (ca.SX(0), ca.SX(0))
    return pressed(w, kr, ks, g)


def _speeds(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    v, u = _velocity(rates, g)[0]
    return [ca.sqrt(v * v + u * u + TINY) * laws[0].sign([v, u], (1.0, g["radius"]))]


def _rests(j: Rubs) -> list[Pair]:
    """The capacity is an upper bound. The axial friction ratio k_s changes the couple Y of the end forces: Y = Y_0 + β F with |β| ≤
    μ r/c. Therefore |F ± Y| ≤ |F ± Y_0| + |β||F|. For a given sliding direction, β is known and the capacity is exact."""
    import numpy as np

    from trunnion.elements.contact.static_friction_capacity import Capacity, Norm, Pair, sine

    mu, r = j.static, j.sizes["radius"]
    if j.adams:
        held, along = Capacity((Norm(j.rows(("f2", "f3")), mu), *j.preload(mu))), None
    else:
        c, across = j.sizes["half_length"], j.rows(("f3", "f2"))
        ends = j.ends(("f2", "f3"), ("m2", "m3"), c, mu)
        loose = tuple(replace(n, weight=0.5 * mu) for n in ends)
        least = (0.5 * sine(mu),) * 2 + (-sine(mu) * mu * r / c,) + tuple(n.weight for n in j.preload(mu))
        held = Capacity((*loose, Norm(across, mu * mu * r / c, 0.0), *j.preload(mu)), 0, False, least)

        def along(d: np.ndarray) -> Capacity:
            ks, kr = mu * j.sense * d
            beta = ks * r / c * (1 - 1j * kr) / (1 + kr * kr)
            turned = np.array([[beta.real, -beta.imag], [beta.imag, beta.real]]) @ across
            weight = 0.5 * mu / float(np.hypot(1.0, kr))
            both = (Norm(n.rows + s * turned, weight, 0.5) for n, s in zip(ends, (1.0, -1.0), strict=True))
            return Capacity((*both, *j.preload(mu)))

    return [Pair(j.joint, 1, j.eta, np.diag([1.0, 1.0 / r]), (held,), mu, along=along)]


SHAFT = ContactElement(
    "shaft", _needs, _friction, _held, _contacts, _velocity, _pressed, 2, springs=4,
    rests=_rests, own_speeds=_speeds, sizes=(RADIUS, HALF_LENGTH, *LENGTHS, PRELOAD), pairs=((0, 1),), places=places, pins=pins,
    plays=(Play((1, 2), (), ("e2", "e3"), ("e3", "e2")),),
)  # fmt: skip
