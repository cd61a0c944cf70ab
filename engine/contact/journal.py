"""Journal and shaft (paper §7.2, §7.3): two contacts at ∓c, closed form of (124)/(136) without a 4×4 solve.

With a_i = f_i cosθ_i, b_i = f_i sinθ_i (method §2):
  a1 + a2 = −(k_r f2 + f3)/(1+k_r²)     y2 = (m2 − k_s r (a1+a2))/c     a1 − a2 = (k_r y3 − y2)/(1+k_r²)
  b1 + b2 =  (k_r f3 − f2)/(1+k_r²)     y3 = (m3 + k_s r (b1+b2))/c     b1 − b2 = (k_r y2 + y3)/(1+k_r²)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca

from engine.contact.base import SX, Contact, ContactElement, Wrench
from engine.friction import Law

TINY = 1e-300


def split(f2: SX, f3: SX, m2: SX, m3: SX, kr: SX, ks: SX, radius: SX, c: SX) -> tuple[SX, SX, SX, SX]:
    """(a1, b1, a2, b2): components of the two normal forces along e3 and e2."""
    n = 1 / (1 + kr * kr)
    a, b = -(kr * f2 + f3) * n, (kr * f3 - f2) * n
    y2, y3 = (m2 - ks * radius * a) / c, (m3 + ks * radius * b) / c
    da, db = (kr * y3 - y2) * n, (kr * y2 + y3) * n
    return 0.5 * (a + da), 0.5 * (b + db), 0.5 * (a - da), 0.5 * (b - db)


def length(a: SX, b: SX) -> SX:
    """hypot with a derivative at zero."""
    return ca.sqrt(a * a + b * b + TINY)


def pair(w: Wrench, kr: SX, ks: SX, g: Mapping[str, SX]) -> tuple[SX, SX, SX, SX]:
    """``split`` of a wrench with the element's geometry."""
    return split(w["f2"], w["f3"], w["m2"], w["m3"], kr, ks, g["radius"], g["half_length"])


def as_contacts(a1: SX, b1: SX, a2: SX, b2: SX) -> list[Contact]:
    """Two contacts with n = cosθ e3 + sinθ e2."""
    return [Contact(length(a, b), (SX(0), b, a), (2, 1)) for a, b in ((a1, b1), (a2, b2))]


# -- journal of a revolute joint ----------------------------------------------------------------------------------------------


def _needs(numbers: Sequence[str], adams: bool) -> tuple[str, ...]:
    axial = ("f1",) if "thrust_radius" in numbers or adams else ()
    return axial + (("f2", "f3") if adams else ("f2", "f3", "m2", "m3"))


def _velocity(rates: list[SX], g: Mapping[str, SX]) -> list[list[SX]]:
    return [[g["radius"] * rates[0]]]


def _ratio(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX]) -> SX:
    return w.pin * laws[0].ratios(_velocity(rates, g)[0])[0]


def _friction(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    """(137) with its sign: m_c1 = k_r r (f_1 + f_2); Adams (152): k_r r |f_c|."""
    kr = _ratio(w, rates, laws, g)
    if adams:
        load = ca.sqrt(w["f1"] ** 2 + w["f2"] ** 2 + w["f3"] ** 2 + TINY)
        return [w.pin * kr * g["radius"] * load]
    a1, b1, a2, b2 = pair(w, kr, SX(0), g)
    load = g["radius"] * (length(a1, b1) + length(a2, b2))
    if "thrust_radius" in g:
        load = load + g["thrust_radius"] * ca.fabs(w["f1"])
    return [w.pin * kr * load]


def _contacts(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX]) -> list[Contact]:
    return as_contacts(*pair(w, _ratio(w, rates, laws, g), SX(0), g))


def _speeds(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    v = _velocity(rates, g)[0]
    return [ca.fabs(v[0]) * laws[0].sign(v, (1.0,))]


JOURNAL = ContactElement("journal", _needs, _friction, _speeds, _contacts, _velocity, 2)


# -- shaft of a cylindrical joint ---------------------------------------------------------------------------------------------


def _shaft_needs(numbers: Sequence[str], adams: bool) -> tuple[str, ...]:
    return ("f2", "f3") if adams else ("f2", "f3", "m2", "m3")


def _shaft_velocity(rates: list[SX], g: Mapping[str, SX]) -> list[list[SX]]:
    return [[rates[0], g["radius"] * rates[1]]]


def _shaft_ratios(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX]) -> tuple[SX, SX]:
    ks, kr = laws[0].ratios(_shaft_velocity(rates, g)[0], (1.0, g["radius"]))
    return w.pin * ks, w.pin * kr


def _shaft_friction(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    """(125), (126): f_c1 = k_s Σf, m_c1 = k_r r Σf; Adams: with the force across the axis."""
    ks, kr = _shaft_ratios(w, rates, laws, g)
    if adams:
        load = length(w["f2"], w["f3"])
    else:
        a1, b1, a2, b2 = pair(w, kr, ks, g)
        load = length(a1, b1) + length(a2, b2)
    return [w.pin * ks * load, w.pin * kr * g["radius"] * load]


def _shaft_contacts(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX]) -> list[Contact]:
    ks, kr = _shaft_ratios(w, rates, laws, g)
    return as_contacts(*pair(w, kr, ks, g))


def _shaft_speeds(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    v, u = _shaft_velocity(rates, g)[0]
    return [ca.sqrt(v * v + u * u + TINY) * laws[0].sign([v, u], (1.0, g["radius"]))]


SHAFT = ContactElement("shaft", _shaft_needs, _shaft_friction, _shaft_speeds, _shaft_contacts, _shaft_velocity, 2)
