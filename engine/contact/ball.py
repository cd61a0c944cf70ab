"""Ball in a socket (paper §7.1): one contact, closed form of (105)–(114) without a 3×3 solve.

With F = |f_c|, f̂ = f_c/F and ω of the socket relative to the ball (method §2):
  proportional law k = K ω-rate:  s² = |f̂×ω|²/(1 + K²(f̂·ω)²),  K = slope · r
  sliding law:                    s² = |ω|² − (f̂·ω)²(1+μ²)
  f_n = F/√(1+μ_e²),  n = (k ω̃ − E)⁻¹ f_c/f_n = −(f + k ω×f + k²(ω·f) ω)/(f_n (1 + k²ω²)),  m_c = r n × f_c
(the last since the normal part of f_c has no arm). f_c ∥ ω gives no torque, F → 0 gives no torque.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca

from engine.contact.base import SX, Contact, ContactElement, Wrench
from engine.friction import Law

TINY = 1e-300
FLOOR = 1e-12
"""Inside the friction cone (sliding speed zero) the sliding form has no real s²; its continuation is floored at this times |ω|²,
so that a trial step past the end of sliding stays finite until the event is found."""


def _dot(a, b) -> SX:
    return sum(x * y for x, y in zip(a, b, strict=True))


def _cross(a, b) -> list[SX]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _state(w: Wrench, rates: list[SX], law: Law, g: Mapping[str, SX]) -> tuple[SX, SX, list[SX], list[SX], list[SX]]:
    """(k, f_n, f_c, ω, n f_n) of the branch in force."""
    f, omega = [w["f1"], w["f2"], w["f3"]], [w.pin * x for x in rates]
    FF, ww, fw = _dot(f, f) + TINY, _dot(omega, omega), _dot(f, omega)
    along2 = fw * fw / FF
    slope, level = law.slope, law.level
    k_p = None if slope is None else slope * g["radius"]
    mue2_p = None if k_p is None else k_p * k_p * (ww - along2) / (1 + k_p * k_p * along2)
    k_s = None
    if level is not None:
        s2 = ca.fmax(ww - along2 * (1 + level * level), FLOOR * ww)
        k_s = level * law.sign(rates, (1.0, 1.0, 1.0)) / ca.sqrt(s2 + TINY)
    k = law.choose(k_s, k_p)
    mue2 = law.choose(None if level is None else level * level, mue2_p)
    fn = ca.sqrt(FF / (1 + mue2))
    wf = _cross(omega, f)
    scale = -1 / (1 + k * k * ww)
    nfn = [scale * (f[i] + k * wf[i] + k * k * fw * omega[i]) for i in range(3)]
    return k, fn, f, omega, nfn


def _friction(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    """(110); Adams (151) with its normalisation: r μ_e f × (ω × f)/|ω × f|."""
    law = laws[0]
    if adams:
        return [w.pin * x for x in _adams(w, rates, law, g)]
    _, fn, f, _, nfn = _state(w, rates, law, g)
    return [w.pin * g["radius"] * x / fn for x in _cross(nfn, f)]


def _adams(w: Wrench, rates: list[SX], law: Law, g: Mapping[str, SX]) -> list[SX]:
    f, omega = [w["f1"], w["f2"], w["f3"]], [w.pin * x for x in rates]
    wf = _cross(omega, f)
    F = ca.sqrt(_dot(f, f) + TINY)
    s = ca.sqrt(_dot(wf, wf) + TINY) / F
    proportional = None if law.slope is None else law.slope * g["radius"]
    k = law.choose(None if law.level is None else law.level * law.sign(rates, (1.0, 1.0, 1.0)) / s, proportional)
    return [g["radius"] * k * x / F for x in _cross(f, wf)]


def _speeds(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    """r |ω × n|; the proportional form alone selects the branch (method §2), so it is the one reported; Adams: r |ω × f̂|."""
    f, omega = [w["f1"], w["f2"], w["f3"]], [w.pin * x for x in rates]
    FF, ww, fw = _dot(f, f) + TINY, _dot(omega, omega), _dot(f, omega)
    along2 = fw * fw / FF
    law = laws[0]
    K = SX(0) if adams or law.slope is None else law.slope * g["radius"]
    s2 = ca.fmax(ww - along2, 0) / (1 + K * K * along2)
    return [g["radius"] * ca.sqrt(s2 + TINY) * law.sign(rates, (1.0, 1.0, 1.0))]


def _contacts(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX]) -> list[Contact]:
    law = laws[0]
    if law.kinks:  # branch and direction are those of this very instant, not what a step has frozen or Adams' friction has chosen
        law.frozen = list(rates)
        law.flag = ca.fabs(_speeds(w, rates, laws, g, False)[0]) >= law.kink
    _, fn, _, _, nfn = _state(w, rates, law, g)
    return [Contact(fn, (nfn[0], nfn[1], nfn[2]), (0, 2), inboard=True)]


def _needs(numbers: Sequence[str], adams: bool) -> tuple[str, ...]:
    return ("f1", "f2", "f3")


def _velocity(rates: list[SX], g: Mapping[str, SX]) -> list[list[SX]]:
    return [list(rates)]


BALL = ContactElement("ball", _needs, _friction, _speeds, _contacts, _velocity, 1, frame="inboard")
