"""Journal of a revolute joint (paper §7.3): two contacts at ∓c from the pin's point, and what it shares with a shaft.

(124) and (136) are solved in closed form for a_i = f_i cosθ_i and b_i = f_i sinθ_i (METHOD, "Journal and shaft").
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from engine.basics.numbers import NOT_NEGATIVE, POSITIVE
from engine.basics.symbolic import SX, ca
from engine.contact.base import (
    FIXED,
    OVERLAP,
    SPAN,
    Contact,
    ContactElement,
    Hold,
    Place,
    Size,
    Solid,
    Wrench,
    ratio_held,
    signum,
    while_sliding,
)
from engine.friction import Law

if TYPE_CHECKING:
    from engine.contact.resting import Pair, Rubs

TINY = 1e-300
HALF_ROOT = math.sqrt(0.5)


def sums(f2: SX, f3: SX, m2: SX, m3: SX, kr: SX, ks: SX, radius: SX, c: SX) -> tuple[SX, SX, SX, SX]:
    """Solution of (124) as a1 + a2, b1 + b2, a1 − a2, b1 − b2 of the components of the two normal forces along e3 and e2, N. kr,
    ks: friction ratios around and along the pin; radius of the pin and half length c, m."""
    n = 1 / (1 + kr * kr)
    a, b = -(kr * f2 + f3) * n, (kr * f3 - f2) * n
    y2, y3 = (m2 - ks * radius * a) / c, (m3 + ks * radius * b) / c
    return a, b, (kr * y3 - y2) * n, (kr * y2 + y3) * n


def split(f2: SX, f3: SX, m2: SX, m3: SX, kr: SX, ks: SX, radius: SX, c: SX) -> tuple[SX, SX, SX, SX]:
    """(a1, b1, a2, b2) of ``sums``."""
    a, b, da, db = sums(f2, f3, m2, m3, kr, ks, radius, c)
    return 0.5 * (a + da), 0.5 * (b + db), 0.5 * (a - da), 0.5 * (b - db)


def length(a: SX, b: SX) -> SX:
    """√(a² + b²), with a derivative at zero too."""
    return ca.sqrt(a * a + b * b + TINY)


def pair(w: Wrench, kr: SX, ks: SX, g: Mapping[str, SX]) -> tuple[SX, SX, SX, SX]:
    """``split`` of what the joint presses, with the element's sizes."""
    return split(w["f2"], w["f3"], w["m2"], w["m3"], kr, ks, g["radius"], half_length(w, g))


def pressed(w: Wrench, kr: SX, ks: SX, g: Mapping[str, SX]) -> list[SX]:
    """The two forces across a pin as their ``sums`` over √2: the same sum of squares, and what presses both ends alike is apart
    from what tilts the pin."""
    found = sums(w["f2"], w["f3"], w["m2"], w["m3"], kr, ks, g["radius"], half_length(w, g))
    return [HALF_ROOT * x for x in found]


def as_contacts(a1: SX, b1: SX, a2: SX, b2: SX) -> list[Contact]:
    """The two contacts of ``split``; n = cosθ e3 + sinθ e2."""
    return [Contact(length(a, b), (ca.SX(0), b, a), (2, 1)) for a, b in ((a1, b1), (a2, b2))]


def _needs(numbers: Sequence[str], adams: bool) -> tuple[str, ...]:
    axial = ("f1",) if "thrust_radius" in numbers or adams else ()
    return axial + (("f2", "f3") if adams else ("f2", "f3", "m2", "m3"))


def _velocity(rates: list[SX], g: Mapping[str, SX]) -> list[list[SX]]:
    return [[g["radius"] * rates[0]]]


def _ratio(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX]) -> SX:
    return w.pin * laws[0].ratios(_velocity(rates, g)[0])[0]


def _load(w: Wrench, kr: SX, g: Mapping[str, SX], adams: bool) -> SX:
    """What friction is proportional to: f_1 + f_2 and a preload, with an axial thrust at its own radius; in Adams' form |f_c|
    for f_1 + f_2."""
    if adams:
        return preloaded(ca.sqrt(w["f1"] ** 2 + w["f2"] ** 2 + w["f3"] ** 2 + TINY), g)
    a1, b1, a2, b2 = pair(w, kr, ca.SX(0), g)
    load = preloaded(length(a1, b1) + length(a2, b2), g)
    return load + g["thrust_radius"] / g["radius"] * ca.fabs(w["f1"]) if "thrust_radius" in g else load


def _friction(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    """Friction torque (137), with its sign: k_r r (f_1 + f_2); in Adams' form (152) k_r r |f_c|."""
    kr = _ratio(w, rates, laws, g)
    return [w.pin * kr * g["radius"] * _load(w, kr, g, adams)]


def _held(w: Wrench, u: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[Hold]:
    """The loads depend on |k_r| alone, so that the capacity is their value at μ_static (METHOD, "Rest")."""
    most = laws[0].static
    return [Hold(most * _load(w, w.pin * most * signum(u[0]), g, adams), ca.fabs(u[0]) / g["radius"])]


def _contacts(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[Contact]:
    kr = _ratio(w, rates, laws, g)
    if laws[0].sets:
        side = w.pin * signum(eta[0])
        still = ratio_held(lambda k: _load(w, side * k, g, False), ca.fabs(eta[0]) / g["radius"])
        kr = ca.if_else(laws[0].stuck, side * still, kr)
    return as_contacts(*pair(w, kr, ca.SX(0), g))


def _pressed(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX]) -> list[SX]:
    kr = while_sliding(laws[0], _ratio(w, rates, laws, g)) if laws else ca.SX(0)
    return pressed(w, kr, ca.SX(0), g)


def _speeds(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    v = _velocity(rates, g)[0]
    return [ca.fabs(v[0]) * laws[0].sign(v, (1.0,))]


RADIUS = Size("radius", "m", "radius of the pin", POSITIVE, '"20 mm"', symbol="r")
HALF_LENGTH = Size(
    "half_length", "m", "c: the contact points sit at -c and +c from the point of the part that has the ends", POSITIVE, '"20 mm"',
    symbol="c", drawn=0.06, ends=FIXED,
)  # fmt: skip
LENGTHS = tuple(
    Size(
        f"{part}_length", "m", f"with ends: overlap, length of the {part} part along the axis, its point in its middle", POSITIVE,
        '"60 mm"', drawn=0.12, ends=OVERLAP,
    )
    for part in ("inboard", "outboard")
)  # fmt: skip


def spanned(needs: tuple[str, ...], numbers: Sequence[str]) -> tuple[str, ...]:
    """What forms need, with the span where that changes as parts slide."""
    return (*needs, SPAN) if LENGTHS[0].name in numbers else needs


def half_length(w: Wrench, g: Mapping[str, SX]) -> SX:
    """c: half the length over which pin and bearing touch, m."""
    return w[SPAN] if SPAN in w.values else g["half_length"]


def far(g: Mapping[str, float]) -> float:
    """c as drawn: of parts that overlap, half the length of the shorter one."""
    return 0.5 * min(g[s.name] for s in LENGTHS) if LENGTHS[0].name in g else g["half_length"]


THRUST_RADIUS = Size(
    "thrust_radius", "m", "arm at which an axial thrust rubs (the paper's end face has none)", POSITIVE, '"10 mm"', needed=False,
    symbol="r_t",
)  # fmt: skip


PRELOAD = Size(
    "preload", "N", "force with which a spring or an interference presses all around, beside the loads (a seal)", NOT_NEGATIVE,
    '"50 N"', needed=False, symbol="P", bears=False, varies=True,
)  # fmt: skip


def preloaded(load: SX, g: Mapping[str, SX], label: str = "preload") -> SX:
    """What friction is proportional to, with what presses whatever the load is."""
    return load + g[label] if label in g else load


def places(g: Mapping[str, float]) -> list[Place]:
    """The ends."""
    r, c = g["radius"], far(g)
    return [Place("pin", 0, along, r, area=2 * r * c, arc=r * c) for along in (-c, c)]


def pins(g: Mapping[str, float]) -> list[Solid]:
    """A cylinder."""
    return [Solid("cylinder", (g["radius"], 2 * far(g)))]


def _rests(j: Rubs) -> list[Pair]:
    import numpy as np

    from engine.contact.resting import Capacity, Norm, Pair, adams_forces, ends_of, preload, static, whole

    mu, r = static(j), j.sizes["radius"]
    if j.adams:
        norms: tuple[Norm, ...] = (Norm(whole(j, adams_forces(j)), mu),)
    else:
        norms = ends_of(j, ("f2", "f3"), ("m2", "m3"), j.sizes["half_length"], mu)
        if "thrust_radius" in j.sizes:
            norms += (Norm(whole(j, ("f1",)), mu * j.sizes["thrust_radius"] / r),)
    norms += preload(j, mu)
    return [Pair(j.joint, 1, j.eta, np.array([[1.0 / r]]), (Capacity(norms),), mu)]


JOURNAL = ContactElement(
    "journal", _needs, _friction, _speeds, _held, _contacts, _velocity, _pressed, 2, springs=4,
    rests=_rests, sizes=(RADIUS, HALF_LENGTH, THRUST_RADIUS, PRELOAD), pairs=((0,),), places=places, pins=pins, thrusts=("f1",),

)  # fmt: skip
