"""Closed forms for the contact and friction of a ball in its socket, on the active branch of a law (theory, "Ball")."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.elements.contact.contact_element import TINY, Wrench
from trunnion.elements.friction import Law

FLOOR = 1e-24
"""Lower bound of s²/|ω|² on the sliding branch. Inside the friction cone, the formula gives no real s; with the bound, a trial step
past the end of sliding stays finite until the event is located. Near the border of the cone, friction varies as the square root of
the distance to the border, but is a smooth function of the tilt u = s/|ω|, the sine of the angle between ω and the normal. The
runtime therefore solves for u near the border. If the mode gives a tilt > 0, friction is computed from u instead of the distance
(theory, "Ball near its cone")."""


def dot(a, b) -> SX:
    """Dot product."""
    return sum(x * y for x, y in zip(a, b, strict=True))


def cross(a, b) -> list[SX]:
    """a × b."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


class BallContact(NamedTuple):
    """Contact of a ball with friction.

    f            force f_c
    way          unit vector along ω
    FF, fw       f² and the component of f along ω
    one, k, kk   the weights 1, k|ω| and k²ω² of (114), each divided by 1 + k²ω²
    mue2         μ_e²
    """

    f: list[SX]
    way: list[SX]
    FF: SX
    fw: SX
    one: SX
    k: SX
    kk: SX
    mue2: SX

    def load(self) -> tuple[SX, list[SX]]:
        """f_n and n f_n."""
        wf = cross(self.way, self.f)
        n = [-(self.one * self.f[i] + self.k * wf[i] + self.kk * self.fw * self.way[i]) for i in range(3)]
        return ca.sqrt(self.FF / (1 + self.mue2)), n

    def turning(self) -> list[SX]:
        """n × f. The code uses (ω×f)×f = (f·ω) f − f² ω and F²/f_n = f_n (1 + μ_e²)."""
        fn, wf = ca.sqrt(self.FF / (1 + self.mue2)), cross(self.way, self.f)
        share, across = self.fw / fn, self.k * fn * (1 + self.mue2)
        return [across * self.way[i] - self.k * share * self.f[i] - self.kk * share * wf[i] for i in range(3)]


def ball_contact(w: Wrench, rates: list[SX], law: Law, g: Mapping[str, SX]) -> BallContact:
    """Contact on the active branch of the law. The suffixes _p and _s denote the proportional and the sliding branch.

    With the tilt u = s/|ω| and k|ω| = μ_e/u, the weights are u², μ_e u and μ_e², each divided by u² + μ_e². The divisor therefore
    contains no square root. The factor is written as −1/(u² + μ_e²), because the symbolic library turns a product with 1/x into a
    division."""
    f, omega = [w["f1"], w["f2"], w["f3"]], [w.pin * x for x in law.moving(rates, (1.0, 1.0, 1.0))]
    speed = ca.sqrt(dot(omega, omega) + TINY)
    way = [x / speed for x in omega]
    FF, fw = dot(f, f) + TINY, dot(f, way)
    along2 = fw * fw / FF
    slope, level = slope_of(f, rates, law, g), level_of(f, rates, law, g)
    of_p: Sequence[SX | None] = [None] * 4
    of_s: Sequence[SX | None] = [None] * 4
    if slope is not None:
        k = slope * g["radius"] * speed
        one = 1 / (1 + k * k)
        of_p = (one, k * one, k * k * one, k * k * (1 - along2) / (1 + k * k * along2))
    if level is not None:
        mue = level * law.side(rates, (1.0, 1.0, 1.0))
        u2, drag = ca.fmax(1 - along2 * (1 + mue * mue), FLOOR), drag_of(rates, omega, law, g)
        if drag is not None:
            drag = drag * speed
            half, square = along2 * mue * drag, 1 + along2 * drag * drag
            u2 = (u2 / (ca.sqrt(half * half + square * u2) + half)) ** 2  # formula without cancellation for the positive root u
        u2 = ca.if_else(law.tilt > 0, law.tilt * law.tilt, u2)
        u = ca.sqrt(u2)
        mue = mue if drag is None else mue + drag * u
        part = -1 / (u2 + mue * mue)
        of_s = (-u2 * part, -mue * u * part, -mue * mue * part, mue * mue)
    return BallContact(f, way, FF, fw, *map(law.choose, of_s, of_p))


def load_of(w: Wrench, rates: list[SX], law: Law, g: Mapping[str, SX]) -> tuple[SX, list[SX]]:
    """f_n and n f_n on the active branch of the law."""
    if law.bristles:
        return pressed(w, bristles(w, rates, law, g, False)[1])
    return ball_contact(w, rates, law, g).load()


def pressed(w: Wrench, kappa: list[SX]) -> tuple[SX, list[SX]]:
    """f_n and n f_n of a law with bristles, whose friction force is f_n κ × n."""
    f = [w["f1"], w["f2"], w["f3"]]
    FF, kk, fk = dot(f, f) + TINY, dot(kappa, kappa), dot(f, kappa)
    along2, kf = fk * fk / FF, cross(kappa, f)
    scale = -1 / (1 + kk)
    return ca.sqrt(FF * (1 + along2) / (1 + kk)), [scale * (f[i] + kf[i] + fk * kappa[i]) for i in range(3)]


def bristles(w: Wrench, rates: list[SX], law: Law, g: Mapping[str, SX], adams: bool) -> tuple[list[SX], list[SX]]:
    """Rates of the bristle states and friction vector κ, both with the pin's sign. In Adams' form, the direction of the force
    replaces the normal."""
    omega, state = [w.pin * x for x in rates], [w.pin * x for x in law.state]
    normal = [w["f1"], w["f2"], w["f3"]] if adams else pressed(w, state)[1]
    spin = dot(normal, omega) / (dot(normal, normal) + TINY)
    v = [g["radius"] * (omega[i] - spin * normal[i]) for i in range(3)]
    return law.drift(v, state), law.carried(v, state)


def level_of(f: list[SX], rates: list[SX], law: Law, g: Mapping[str, SX]) -> SX | None:
    """The law's level at the speed r |ω × f̂| (theory, "Ball")."""
    wf = cross(rates, f)
    return law.level(g["radius"] ** 2 * dot(wf, wf) / (dot(f, f) + TINY))


def slope_of(f: list[SX], rates: list[SX], law: Law, g: Mapping[str, SX]) -> SX | None:
    """The law's slope at the speed of ``level_of``."""
    wf = cross(rates, f)
    return law.slope(g["radius"] ** 2 * dot(wf, wf) / (dot(f, f) + TINY))


def drag_of(rates: list[SX], omega: list[SX], law: Law, g: Mapping[str, SX]) -> SX | None:
    """Viscous part of μ_e, divided by |ω|. The speed is the true speed, even if a direction frozen at rest replaces ω
    (``Law.moving``)."""
    if law.drag is None:
        return None
    return law.drag * g["radius"] * ca.sqrt((dot(rates, rates) + TINY) / (dot(omega, omega) + TINY))


def adams_friction(w: Wrench, rates: list[SX], law: Law, g: Mapping[str, SX]) -> list[SX]:
    """Friction torque in Adams' form (151), with the pin's sign: r μ_e f × (ω × f)/|ω × f|."""
    if law.bristles:
        f = [w["f1"], w["f2"], w["f3"]]
        return [g["radius"] * x / ca.sqrt(dot(f, f) + TINY) for x in cross(f, cross(bristles(w, rates, law, g, True)[1], f))]
    f, omega = [w["f1"], w["f2"], w["f3"]], [w.pin * x for x in law.moving(rates, (1.0, 1.0, 1.0))]
    wf = cross(omega, f)
    F = ca.sqrt(dot(f, f) + TINY)
    s = ca.sqrt(dot(wf, wf) + TINY) / F
    slope = slope_of(f, rates, law, g)
    proportional = None if slope is None else slope * g["radius"]
    level, drag = level_of(f, rates, law, g), drag_of(rates, omega, law, g)
    side = law.side(rates, (1.0, 1.0, 1.0))
    sliding = None if level is None else level * side / s + (0 if drag is None else drag)
    k = law.choose(sliding, proportional)
    return [g["radius"] * k * x / F for x in cross(f, wf)]
