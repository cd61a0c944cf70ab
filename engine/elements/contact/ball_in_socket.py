"""Ball in a socket (paper §7.1): one contact, closed form of (105)–(114) without a 3×3 solve (theory, "Ball").

f = f_c, F = |f_c|, f̂ = f_c/F; ω is the angular velocity of the socket relative to the ball; s = |ω×n|; μ_e is the friction ratio:
  proportional branch, μ_e = K s:   s² = |f̂×ω|²/(1 + K²(f̂·ω)²),  K = slope · r
  sliding branch, μ_e given:        s² = |ω|² − (f̂·ω)²(1+μ_e²)
  f_n = F/√(1+μ_e²),   n = −(f + k ω×f + k²(ω·f) ω)/(f_n (1 + k²ω²)) with k = μ_e/s,   m_c = r n × f_c
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.basics.number_declarations import POSITIVE
from trunnion.elements.contact.ball_in_socket_friction import (
    TINY,
    adams_friction,
    ball_contact,
    bristles,
    cross,
    dot,
    drag_of,
    level_of,
    load_of,
    slope_of,
)
from trunnion.elements.contact.clearance import Play
from trunnion.elements.contact.contact_element import HELD_MOST, Contact, ContactElement, Hold, Place, Size, Solid, Wrench
from trunnion.elements.friction import Law
from trunnion.elements.friction.friction_law import HALF
from trunnion.runtime.abi import PairState

if TYPE_CHECKING:
    from trunnion.elements.contact.static_friction_capacity import Pair, Rubs


def _drift(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    return [w.pin * x for x in bristles(w, rates, laws[0], g, adams)[0]]


def _friction(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    """Friction torque (110), or Adams' form (151) with Adams' normalisation: r μ_e f × (ω × f)/|ω × f|."""
    law = laws[0]
    if adams:
        return [w.pin * x for x in adams_friction(w, rates, law, g)]
    if law.bristles:
        fn, nfn = load_of(w, rates, law, g)
        return [w.pin * g["radius"] * x / fn for x in cross(nfn, [w["f1"], w["f2"], w["f3"]])]
    touch = ball_contact(w, rates, law, g)
    f, slides = touch.f, [w.pin * g["radius"] * x for x in touch.turning()]
    if not law.sets:
        return slides
    spins = [w.pin * g["radius"] * x for x in cross(_spin_normal(w, rates, law), f)]
    return [ca.if_else(law.flag > PairState.SLIPS.value + HALF, b, a) for a, b in zip(slides, spins, strict=True)]


def _spin_normal(w: Wrench, rates: list[SX], law: Law) -> list[SX]:
    """Contact normal n = ∓ω̂ of a ball that turns without sliding, because ω lies inside the friction cone. The sign is chosen so
    that n · f < 0."""
    f = [w["f1"], w["f2"], w["f3"]]
    omega = [w.pin * x for x in law.moving(rates, (1.0, 1.0, 1.0))]
    size = ca.sqrt(dot(omega, omega) + TINY)
    side = ca.if_else(dot(f, omega) < 0, 1, -1)
    return [side * (x / size) for x in omega]


def _held(w: Wrench, u: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[Hold]:
    """Static friction: |m| ≤ r F sin(atan μ), where m is the component of the torque normal to the force. A point contact holds no
    torque about the force."""
    f, most = [w["f1"], w["f2"], w["f3"]], laws[0].static
    F = ca.sqrt(dot(f, f) + TINY)
    size = (ca.sqrt(dot(u, u) + TINY) - math.sqrt(TINY)) / g["radius"]  # 0 for zero torque, so that a ball without load holds
    capacity = most * F if adams else most * F / ca.sqrt(1 + most * most)
    return [Hold(capacity, size, ca.SX(0) if adams else ca.fabs(dot(u, f)) / (F * g["radius"]))]


def _speeds(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    """Sliding speed r |ω × n|; in Adams' form r |ω × f̂|. The proportional formula is used on both branches, because the result
    only selects the branch, and both formulas cross the kink together (theory, "Ball")."""
    f, omega = [w["f1"], w["f2"], w["f3"]], [w.pin * x for x in rates]
    FF, ww, fw = dot(f, f) + TINY, dot(omega, omega), dot(f, omega)
    along2 = fw * fw / FF
    law = laws[0]
    slope = None if adams else slope_of(f, rates, law, g)
    K = ca.SX(0) if slope is None else slope * g["radius"]
    s2 = ca.fmax(ww - along2, 0) / (1 + K * K * along2)
    return [g["radius"] * ca.sqrt(s2 + TINY) * law.sign(rates, (1.0, 1.0, 1.0))]


def _cone(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    """s²/|ω|²: positive while the ball slides, negative while ω lies inside the friction cone about the force. For a law with a
    viscous part, only the sign is correct, unless the mode gives the tilt. The value is 1 in Adams' form, which has no cone."""
    law, f = laws[0], [w["f1"], w["f2"], w["f3"]]
    level = level_of(f, rates, law, g)
    if adams or level is None:
        return [ca.SX(1)]
    omega = law.moving(rates, (1.0, 1.0, 1.0))
    fw, ww, drag = dot(f, omega), dot(omega, omega), drag_of(rates, omega, law, g)
    if drag is not None:
        level = ca.if_else(law.tilt > 0, level + drag * law.tilt * ca.sqrt(ww + TINY), level)
    return [1 - fw * fw * (1 + level**2) / ((dot(f, f) + TINY) * (ww + TINY) + TINY)]  # the product is 0 at rest without load


def _at_rest(w: Wrench, eta: list[SX], law: Law, g: Mapping[str, SX]) -> tuple[SX, list[SX]]:
    """f_n and n f_n of a ball at rest, from its friction torque m. The relation m = r n × f_c gives n = −cosφ f̂ + sinφ f̂ × m̂
    with sinφ = |m|/(r F). The friction ratio tanφ is limited to HELD_MOST · μ_static, as in ``ratio_held``."""
    f, m = [w["f1"], w["f2"], w["f3"]], [w.pin * x for x in eta]
    F, M = ca.sqrt(dot(f, f) + TINY), ca.sqrt(dot(m, m) + TINY)
    most = HELD_MOST * law.static
    sin = ca.fmin(M / (g["radius"] * F), most / ca.sqrt(1 + most * most))
    cos = ca.sqrt(1 - sin * sin)
    across = cross(f, m)
    return F * cos, [F * cos * (-cos * f[i] / F + sin * across[i] / (F * M)) for i in range(3)]


def _contacts(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[Contact]:
    law = laws[0]
    if law.sets:
        return [_set_contact(w, rates, law, g, eta)]
    if law.kinks:  # the contact uses the branch and direction of this instant, not frozen ones
        law.frozen = list(rates)
        law.flag = ca.fabs(_speeds(w, rates, laws, g, False)[0]) >= law.kink
    fn, nfn = load_of(w, rates, law, g)
    return [Contact(fn, (nfn[0], nfn[1], nfn[2]), (0, 2), inboard=True)]


def _pressed_in(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[SX]:
    """The vector f_n n. Without friction, this vector is −f_c; with friction, it has the direction of the contact normal."""
    f = [w["f1"], w["f2"], w["f3"]]
    if not laws:
        return [-x for x in f]
    law = laws[0]
    slides = load_of(w, rates, law, g)[1]
    if not law.sets:
        return slides
    normal = _spin_normal(w, rates, law)
    spin = -dot(normal, f)
    spins, rests = law.flag > PairState.SLIPS.value + HALF, _at_rest(w, eta, law, g)[1] if eta else [-x for x in f]
    return [ca.if_else(law.stuck, rests[i], ca.if_else(spins, spin * normal[i], slides[i])) for i in range(3)]


def _set_contact(w: Wrench, rates: list[SX], law: Law, g: Mapping[str, SX], eta: list[SX]) -> Contact:
    """Contact under a set-valued law, for a ball that slides, turns without sliding, or is at rest."""
    f = [w["f1"], w["f2"], w["f3"]]
    fn, nfn = load_of(w, rates, law, g)
    normal = _spin_normal(w, rates, law)
    spin = -dot(normal, f)
    held, vector = _at_rest(w, eta, law, g)
    inside = _cone(w, rates, [law], g, False)[0] < 0  # computed here, because runs with Adams' friction never set the flag
    values = [
        ca.if_else(law.stuck, rest, ca.if_else(inside, turning, sliding))
        for sliding, turning, rest in zip((fn, *nfn), (spin, *(spin * x for x in normal)), (held, *vector), strict=True)
    ]
    return Contact(values[0], (values[1], values[2], values[3]), (0, 2), inboard=True)


def _needs(numbers: Sequence[str], adams: bool) -> tuple[str, ...]:
    return ("f1", "f2", "f3")


def _velocity(rates: list[SX], g: Mapping[str, SX]) -> list[list[SX]]:
    return [list(rates)]


def _rests(j: Rubs) -> list[Pair]:
    import numpy as np

    from trunnion.elements.contact.static_friction_capacity import Capacity, Norm, Pair, sine

    mu, force = j.static, j.rows(("f1", "f2", "f3"))
    held = Capacity((Norm(force, mu if j.adams else sine(mu)),))
    return [Pair(j.joint, 1, j.eta, np.eye(3) / j.sizes["radius"], (held,), mu, None if j.adams else force)]


BALL = ContactElement(
    "ball", _needs, _friction, _held, _contacts, _velocity, _pressed_in, 1, springs=3,
    sizes=(Size("radius", "m", "radius of the ball", POSITIVE, '"20 mm"', symbol="r"),),
    pairs=((0, 1, 2),), rests=_rests, places=lambda g: [Place("pin", 0, 0.0, g["radius"], area=math.pi * g["radius"] ** 2)],
    pins=lambda g: [Solid("sphere", (g["radius"],))], frame="inboard", cone=_cone, drift=_drift, own_speeds=_speeds,
    plays=(Play((0, 1, 2), (), (), ("e1", "e3")),),
)  # fmt: skip
