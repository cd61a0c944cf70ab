"""Ball in a socket (paper §7.1): one contact, closed form of (105)–(114) without a 3×3 solve (METHOD, "Ball").

With F = |f_c|, f̂ = f_c/F, ω of the socket relative to the ball, and s = |ω×n|:
  proportional law, μ_e = K s:   s² = |f̂×ω|²/(1 + K²(f̂·ω)²),  K = slope · r
  sliding law, μ_e given:        s² = |ω|² − (f̂·ω)²(1+μ_e²)
  f_n = F/√(1+μ_e²),   n = −(f + k ω×f + k²(ω·f) ω)/(f_n (1 + k²ω²)) with k = μ_e/s,   m_c = r n × f_c
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from engine.abi import PairState
from engine.basics.numbers import POSITIVE
from engine.basics.symbolic import SX, ca
from engine.contact.base import Contact, ContactElement, Hold, Place, Size, Solid, Wrench
from engine.friction import Law
from engine.friction.base import HALF

if TYPE_CHECKING:
    from engine.contact.resting import Pair, Rubs

TINY = 1e-300
FLOOR = 1e-24
"""Inside the friction cone (sliding speed zero) the sliding form has no real s²; its continuation is floored at this times |ω|²,
so that a trial step past the end of sliding stays finite until the event is found.

At the border of the cone friction goes as the root of the distance to it. There the runtime solves for the tilt u = s/|ω|, the sine
of the angle between ω and the normal, in which everything is smooth: friction at a given tilt (> 0 in the mode) does not look at
the distance (METHOD, "Ball near its cone")."""


def _dot(a, b) -> SX:
    return sum(x * y for x, y in zip(a, b, strict=True))


def _cross(a, b) -> list[SX]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _state(w: Wrench, rates: list[SX], law: Law, g: Mapping[str, SX]) -> tuple[SX, list[SX], list[SX]]:
    """(f_n, f_c, n f_n) with the law's branch in force. Pairs ending in _p and _s are of the proportional and of the sliding
    branch: k, and μ_e squared."""
    if law.bristles:
        return _pressed(w, _bristles(w, rates, law, g, False)[1])
    f, omega = [w["f1"], w["f2"], w["f3"]], [w.pin * x for x in law.moving(rates, (1.0, 1.0, 1.0))]
    FF, ww, fw = _dot(f, f) + TINY, _dot(omega, omega), _dot(f, omega)
    along2 = fw * fw / FF
    slope, level = _slope(f, rates, law, g), _level(f, rates, law, g)
    k_p = None if slope is None else slope * g["radius"]
    mue2_p = None if k_p is None else k_p * k_p * (ww - along2) / (1 + k_p * k_p * along2)
    k_s = mue2_s = None
    if level is not None:
        level = level * law.side(rates, (1.0, 1.0, 1.0))
        s2, drag = ca.fmax(ww - along2 * (1 + level * level), FLOOR * ww), _drag(rates, omega, law, g)
        s, given = ca.sqrt(s2 + TINY), law.tilt * ca.sqrt(ww + TINY)
        if drag is not None:
            half, square = along2 * level * drag, 1 + along2 * drag * drag
            s = s2 / (ca.sqrt(half * half + square * s2 + TINY) + half)  # the positive root, without its cancellation
        s = ca.if_else(law.tilt > 0, given, s)
        mue = level if drag is None else level + drag * s
        k_s, mue2_s = mue / s, mue * mue
    k, mue2 = law.choose(k_s, k_p), law.choose(mue2_s, mue2_p)
    fn = ca.sqrt(FF / (1 + mue2))
    wf = _cross(omega, f)
    scale = -1 / (1 + k * k * ww)
    return fn, f, [scale * (f[i] + k * wf[i] + k * k * fw * omega[i]) for i in range(3)]


def _pressed(w: Wrench, kappa: list[SX]) -> tuple[SX, list[SX], list[SX]]:
    """As ``_state``, when friction is f_n κ × n (bristles)."""
    f = [w["f1"], w["f2"], w["f3"]]
    FF, kk, fk = _dot(f, f) + TINY, _dot(kappa, kappa), _dot(f, kappa)
    along2, kf = fk * fk / FF, _cross(kappa, f)
    scale = -1 / (1 + kk)
    return ca.sqrt(FF * (1 + along2) / (1 + kk)), f, [scale * (f[i] + kf[i] + fk * kappa[i]) for i in range(3)]


def _bristles(w: Wrench, rates: list[SX], law: Law, g: Mapping[str, SX], adams: bool) -> tuple[list[SX], list[SX]]:
    """Rates of the bristles' states, and the vector κ they rub with, in the pin's sense. In Adams' form n0 lies along the force."""
    omega, state = [w.pin * x for x in rates], [w.pin * x for x in law.state]
    normal = [w["f1"], w["f2"], w["f3"]] if adams else _pressed(w, state)[2]
    spin = _dot(normal, omega) / (_dot(normal, normal) + TINY)
    v = [g["radius"] * (omega[i] - spin * normal[i]) for i in range(3)]
    return law.drift(v, state), law.carried(v, state)


def _drift(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    return [w.pin * x for x in _bristles(w, rates, laws[0], g, adams)[0]]


def _level(f: list[SX], rates: list[SX], law: Law, g: Mapping[str, SX]) -> SX | None:
    """The law's level at the speed across the force, r |ω × f̂|: why there, says METHOD, "Ball"."""
    wf = _cross(rates, f)
    return law.level(g["radius"] ** 2 * _dot(wf, wf) / (_dot(f, f) + TINY))


def _slope(f: list[SX], rates: list[SX], law: Law, g: Mapping[str, SX]) -> SX | None:
    """The law's slope at the same speed."""
    wf = _cross(rates, f)
    return law.slope(g["radius"] ** 2 * _dot(wf, wf) / (_dot(f, f) + TINY))


def _drag(rates: list[SX], omega: list[SX], law: Law, g: Mapping[str, SX]) -> SX | None:
    """μ_e per ω of the law's viscous part. Where a direction frozen at rest stands for ω (``Law.moving``), that part stays what
    it is at the true speed."""
    if law.drag is None:
        return None
    return law.drag * g["radius"] * ca.sqrt((_dot(rates, rates) + TINY) / (_dot(omega, omega) + TINY))


def _friction(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    """Friction torque (110); in Adams' form (151), with its normalisation: r μ_e f × (ω × f)/|ω × f|."""
    law = laws[0]
    if adams:
        return [w.pin * x for x in _adams(w, rates, law, g)]
    fn, f, nfn = _state(w, rates, law, g)
    slides = [w.pin * g["radius"] * x / fn for x in _cross(nfn, f)]
    if not law.sets:
        return slides
    spins = [w.pin * g["radius"] * x for x in _cross(_spin_normal(w, rates, law), f)]
    return [ca.if_else(law.flag > PairState.SLIPS.value + HALF, b, a) for a, b in zip(slides, spins, strict=True)]


def _spin_normal(w: Wrench, rates: list[SX], law: Law) -> list[SX]:
    """Contact normal of a ball that turns inside its friction cone: n = ∓ω̂, against the force, so that nothing slides."""
    f = [w["f1"], w["f2"], w["f3"]]
    omega = [w.pin * x for x in law.moving(rates, (1.0, 1.0, 1.0))]
    size = ca.sqrt(_dot(omega, omega) + TINY)
    side = ca.if_else(_dot(f, omega) < 0, 1, -1)
    return [side * x / size for x in omega]


def _held(w: Wrench, u: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[Hold]:
    """|m| ≤ r F sin(atan μ) across the force, nothing along it: a point contact holds no torque about the force."""
    f, most = [w["f1"], w["f2"], w["f3"]], laws[0].static
    F = ca.sqrt(_dot(f, f) + TINY)
    size = ca.sqrt(_dot(u, u) + TINY) / g["radius"]
    capacity = most * F if adams else most * F / ca.sqrt(1 + most * most)
    return [Hold(capacity, size, ca.SX(0) if adams else ca.fabs(_dot(u, f)) / (F * g["radius"]))]


def _adams(w: Wrench, rates: list[SX], law: Law, g: Mapping[str, SX]) -> list[SX]:
    if law.bristles:
        f = [w["f1"], w["f2"], w["f3"]]
        return [g["radius"] * x / ca.sqrt(_dot(f, f) + TINY) for x in _cross(f, _cross(_bristles(w, rates, law, g, True)[1], f))]
    f, omega = [w["f1"], w["f2"], w["f3"]], [w.pin * x for x in law.moving(rates, (1.0, 1.0, 1.0))]
    wf = _cross(omega, f)
    F = ca.sqrt(_dot(f, f) + TINY)
    s = ca.sqrt(_dot(wf, wf) + TINY) / F
    slope = _slope(f, rates, law, g)
    proportional = None if slope is None else slope * g["radius"]
    level, drag = _level(f, rates, law, g), _drag(rates, omega, law, g)
    side = law.side(rates, (1.0, 1.0, 1.0))
    sliding = None if level is None else level * side / s + (0 if drag is None else drag)
    k = law.choose(sliding, proportional)
    return [g["radius"] * k * x / F for x in _cross(f, wf)]


def _speeds(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    """r |ω × n|; the proportional form alone selects the branch (METHOD, "Ball"), so it is reported; Adams: r |ω × f̂|."""
    f, omega = [w["f1"], w["f2"], w["f3"]], [w.pin * x for x in rates]
    FF, ww, fw = _dot(f, f) + TINY, _dot(omega, omega), _dot(f, omega)
    along2 = fw * fw / FF
    law = laws[0]
    slope = None if adams else _slope(f, rates, law, g)
    K = ca.SX(0) if slope is None else slope * g["radius"]
    s2 = ca.fmax(ww - along2, 0) / (1 + K * K * along2)
    return [g["radius"] * ca.sqrt(s2 + TINY) * law.sign(rates, (1.0, 1.0, 1.0))]


def _cone(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    """s²/|ω|²: positive while the ball slides, negative while ω lies inside the friction cone about the force (with a viscous part
    and no tilt given, it has only the sign of that). Adams' ball has no cone."""
    law, f = laws[0], [w["f1"], w["f2"], w["f3"]]
    level = _level(f, rates, law, g)
    if adams or level is None:
        return [ca.SX(1)]
    omega = law.moving(rates, (1.0, 1.0, 1.0))
    fw, ww, drag = _dot(f, omega), _dot(omega, omega), _drag(rates, omega, law, g)
    if drag is not None:
        level = ca.if_else(law.tilt > 0, level + drag * law.tilt * ca.sqrt(ww + TINY), level)
    return [1 - fw * fw * (1 + level**2) / ((_dot(f, f) + TINY) * (ww + TINY))]


def _at_rest(w: Wrench, eta: list[SX], g: Mapping[str, SX]) -> tuple[SX, list[SX]]:
    """(f_n, n f_n) from the torque held: m = r n × f_c gives n = −cosφ f̂ + sinφ f̂ × m̂ with sinφ = |m|/(r F)."""
    f, m = [w["f1"], w["f2"], w["f3"]], [w.pin * x for x in eta]
    F, M = ca.sqrt(_dot(f, f) + TINY), ca.sqrt(_dot(m, m) + TINY)
    sin = ca.fmin(M / (g["radius"] * F), 1)
    cos = ca.sqrt(1 - sin * sin)
    across = _cross(f, m)
    return F * cos, [F * cos * (-cos * f[i] / F + sin * across[i] / (F * M)) for i in range(3)]


def _contacts(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[Contact]:
    law = laws[0]
    if law.sets:
        return [_set_contact(w, rates, law, g, eta)]
    if law.kinks:  # branch and direction are those of this very instant, not what a step has frozen or Adams' friction has chosen
        law.frozen = list(rates)
        law.flag = ca.fabs(_speeds(w, rates, laws, g, False)[0]) >= law.kink
    fn, _, nfn = _state(w, rates, law, g)
    return [Contact(fn, (nfn[0], nfn[1], nfn[2]), (0, 2), inboard=True)]


def _pressed_in(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX]) -> list[SX]:
    """f_n n: −f_c without friction; of a ball that slides, or turns without sliding, along its contact's normal."""
    f = [w["f1"], w["f2"], w["f3"]]
    if not laws:
        return [-x for x in f]
    law = laws[0]
    slides = _state(w, rates, law, g)[2]
    if not law.sets:
        return slides
    normal = _spin_normal(w, rates, law)
    spin = -_dot(normal, f)
    spins = law.flag > PairState.SLIPS.value + HALF
    return [ca.if_else(law.stuck, -f[i], ca.if_else(spins, spin * normal[i], slides[i])) for i in range(3)]


def _set_contact(w: Wrench, rates: list[SX], law: Law, g: Mapping[str, SX], eta: list[SX]) -> Contact:
    """The contact under a set-valued law: of a ball that slides, of one that turns without sliding, or of one that is held."""
    fn, f, nfn = _state(w, rates, law, g)
    normal = _spin_normal(w, rates, law)
    spin = -_dot(normal, f)
    held, vector = _at_rest(w, eta, g)
    inside = _cone(w, rates, [law], g, False)[0] < 0  # the flag says so too, but not with Adams' friction, which has no cone
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

    from engine.contact.resting import Capacity, Norm, Pair, sine, static, whole

    mu, force = static(j), whole(j, ("f1", "f2", "f3"))
    held = Capacity((Norm(force, mu if j.adams else sine(mu)),))
    return [Pair(j.joint, 1, j.eta, np.eye(3) / j.sizes["radius"], (held,), mu, None if j.adams else force)]


BALL = ContactElement(
    "ball", _needs, _friction, _speeds, _held, _contacts, _velocity, _pressed_in, 1, springs=3,
    sizes=(Size("radius", "m", "radius of the ball", POSITIVE, '"20 mm"', symbol="r"),),
    pairs=((0, 1, 2),), rests=_rests, places=lambda g: [Place("pin", 0, 0.0, g["radius"])],
    pins=lambda g: [Solid("sphere", (g["radius"],))], frame="inboard", cone=_cone, drift=_drift,
)  # fmt: skip
