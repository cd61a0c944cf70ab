"""Journal of a revolute joint (paper §7.3): two contacts at ∓c from the pin's point. The elements of shaft and cross use formulas
of this file.

Equations (124) and (136) have a closed solution in a_i = f_i cosθ_i and b_i = f_i sinθ_i (theory, "Journal and shaft")."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.basics.number_declarations import NOT_NEGATIVE, POSITIVE
from trunnion.elements.contact.clearance import Play
from trunnion.elements.contact.contact_element import (
    FIXED,
    OVERLAP,
    SPAN,
    TINY,
    Contact,
    ContactElement,
    Place,
    SinglePair,
    Size,
    Solid,
    Wrench,
)
from trunnion.elements.friction import Law

if TYPE_CHECKING:
    from trunnion.elements.contact.static_friction_capacity import Pair, Rubs

HALF_ROOT = math.sqrt(0.5)


def sums(f2: SX, f3: SX, m2: SX, m3: SX, kr: SX, ks: SX, radius: SX, c: SX) -> tuple[SX, SX, SX, SX]:
    """Solution of (124): (a1 + a2, b1 + b2, a1 − a2, b1 − b2), N, where a and b are the components of a normal force along e3 and
    e2. kr and ks are the friction ratios around and along the pin. radius and half length c of the pin are in m."""
    n = 1 / (1 + kr * kr)
    a, b = -(kr * f2 + f3) * n, (kr * f3 - f2) * n
    y2, y3 = (m2 - ks * radius * a) / c, (m3 + ks * radius * b) / c
    return a, b, (kr * y3 - y2) * n, (kr * y2 + y3) * n


def split(f2: SX, f3: SX, m2: SX, m3: SX, kr: SX, ks: SX, radius: SX, c: SX) -> tuple[SX, SX, SX, SX]:
    """(a1, b1, a2, b2), N, from the arguments of ``sums``."""
    a, b, da, db = sums(f2, f3, m2, m3, kr, ks, radius, c)
    return 0.5 * (a + da), 0.5 * (b + db), 0.5 * (a - da), 0.5 * (b - db)


def length(a: SX, b: SX) -> SX:
    """√(a² + b²), differentiable at zero."""
    return ca.sqrt(a * a + b * b + TINY)


def pair(w: Wrench, kr: SX, ks: SX, g: Mapping[str, SX]) -> tuple[SX, SX, SX, SX]:
    """(a1, b1, a2, b2), N, for the joint's wrench and the element's sizes."""
    return split(w["f2"], w["f3"], w["m2"], w["m3"], kr, ks, g["radius"], half_length(w, g))


def pressed(w: Wrench, kr: SX, ks: SX, g: Mapping[str, SX]) -> list[SX]:
    """The two forces on a pin, as their sums and differences (``sums``) divided by √2. This factor preserves the sum of squares of
    the forces. The sums describe the mean load, the differences the tilting."""
    found = sums(w["f2"], w["f3"], w["m2"], w["m3"], kr, ks, g["radius"], half_length(w, g))
    return [HALF_ROOT * x for x in found]


def as_contacts(a1: SX, b1: SX, a2: SX, b2: SX) -> list[Contact]:
    """Two contacts from the result of ``split``; n = cosθ e3 + sinθ e2."""
    return [Contact(length(a, b), (ca.SX(0), b, a), (2, 1)) for a, b in ((a1, b1), (a2, b2))]


def _needs(numbers: Sequence[str], adams: bool) -> tuple[str, ...]:
    axial = ("f1",) if "thrust_radius" in numbers or adams else ()
    return axial + (("f2", "f3") if adams else ("f2", "f3", "m2", "m3"))


def _velocity(rates: list[SX], g: Mapping[str, SX]) -> list[list[SX]]:
    return [[g["radius"] * rates[0]]]


def _load(w: Wrench, kr: SX, g: Mapping[str, SX], adams: bool) -> SX:
    """Load to which friction is proportional: f_1 + f_2 + preload + axial thrust × thrust radius / pin radius; in Adams' form |f_c|
    + preload."""
    if adams:
        return with_preload(ca.sqrt(w["f1"] ** 2 + w["f2"] ** 2 + w["f3"] ** 2 + TINY), g)
    a1, b1, a2, b2 = pair(w, kr, ca.SX(0), g)
    load = with_preload(length(a1, b1) + length(a2, b2), g)
    return load + g["thrust_radius"] / g["radius"] * ca.fabs(w["f1"]) if "thrust_radius" in g else load


def _friction(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    """Signed friction torque (137): k_r r (f_1 + f_2). In Adams' form (152): k_r r |f_c|."""
    kr = _PAIR.ratio(w, rates, laws, g)
    return [w.pin * kr * g["radius"] * _load(w, kr, g, adams)]


_PAIR = SinglePair(_velocity, _load, lambda eta, g: ca.fabs(eta) / g["radius"])


def _contacts(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[Contact]:
    return as_contacts(*pair(w, _PAIR.ratio_now(w, rates, laws, g, eta), ca.SX(0), g))


def _pressed(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[SX]:
    return pressed(w, _PAIR.ratio_now(w, rates, laws, g, eta) if laws else ca.SX(0), ca.SX(0), g)


RADIUS = Size("radius", "m", "radius of the pin", POSITIVE, '"20 mm"', symbol="r")
HALF_LENGTH = Size(
    "half_length", "m", "c: the contacts are at -c and +c from the joint point of the part with the ends", POSITIVE, '"20 mm"',
    symbol="c", drawn=0.06, ends=FIXED,
)  # fmt: skip
LENGTHS = tuple(
    Size(
        f"{part}_length", "m", f"for ends: overlap, length of the {part} part, centred on its joint point", POSITIVE,
        '"60 mm"', drawn=0.12, ends=OVERLAP,
    )
    for part in ("inboard", "outboard")
)  # fmt: skip


def with_span(needs: tuple[str, ...], numbers: Sequence[str]) -> tuple[str, ...]:
    """The names ``needs`` of reaction components, with SPAN added if the parts of the joint overlap."""
    return (*needs, SPAN) if LENGTHS[0].name in numbers else needs


def half_length(w: Wrench, g: Mapping[str, SX]) -> SX:
    """Half the length over which pin and bearing overlap (c), m."""
    return w[SPAN] if SPAN in w.values else g["half_length"]


def drawn_half_length(g: Mapping[str, float]) -> float:
    """The half length c for pictures. For overlapping parts, c is half the length of the shorter part."""
    return 0.5 * min(g[s.name] for s in LENGTHS) if LENGTHS[0].name in g else g["half_length"]


THRUST_RADIUS = Size(
    "thrust_radius", "m", "radius at which the friction of axial thrust acts; not in the paper", POSITIVE, '"10 mm"', needed=False,
    symbol="r_t",
)  # fmt: skip


PRELOAD = Size(
    "preload", "N", "radial force of a spring or an interference fit, in addition to the loads (a seal)", NOT_NEGATIVE,
    '"50 N"', needed=False, symbol="P", bears=False, varies=True,
)  # fmt: skip


def with_preload(load: SX, g: Mapping[str, SX], label: str = "preload") -> SX:
    """Load plus preload, if the joint has a preload."""
    return load + g[label] if label in g else load


def places(g: Mapping[str, float]) -> list[Place]:
    """Positions of the contacts at both ends."""
    r, c = g["radius"], drawn_half_length(g)
    return [Place("pin", 0, along, r, area=2 * r * c, arc=r * c) for along in (-c, c)]


def pins(g: Mapping[str, float]) -> list[Solid]:
    """The pin for pictures: a cylinder."""
    return [Solid("cylinder", (g["radius"], 2 * drawn_half_length(g)))]


def _rests(j: Rubs) -> list[Pair]:
    import numpy as np

    from trunnion.elements.contact.static_friction_capacity import Capacity, Norm, Pair

    mu, r = j.static, j.sizes["radius"]
    if j.adams:
        norms: tuple[Norm, ...] = (Norm(j.rows(j.adams_forces), mu),)
    else:
        norms = j.ends(("f2", "f3"), ("m2", "m3"), j.sizes["half_length"], mu)
        if "thrust_radius" in j.sizes:
            norms += (Norm(j.rows(("f1",)), mu * j.sizes["thrust_radius"] / r),)
    norms += j.preload(mu)
    return [Pair(j.joint, 1, j.eta, np.array([[1.0 / r]]), (Capacity(norms),), mu)]


JOURNAL = ContactElement(
    "journal", _needs, _friction, _PAIR.held, _contacts, _velocity, _pressed, 2, springs=4,
    rests=_rests, sizes=(RADIUS, HALF_LENGTH, THRUST_RADIUS, PRELOAD), pairs=((0,),), places=places, pins=pins, thrusts=("f1",),
    plays=(Play((1, 2), ("e1",), ("e2", "e3"), ("e3", "e2")),),
)  # fmt: skip
