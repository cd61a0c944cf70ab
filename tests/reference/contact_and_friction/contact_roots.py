"""The contacts in a joint as numerical roots of the paper's contact equations (105)-(150), without closed forms. All forces act on
the part that carries the pin, at the point of this part and in its joint frame. ``omega``, ``sdot`` are the rates of the *bearing
relative to the pin*. Friction opposes the velocity of the pin's contact point on the bearing.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import brentq

from tests.reference.contact_and_friction.friction_laws import Law
from tests.reference.mechanics.rotation import cross, skew

NAN = float("nan")
E1, E2, E3 = np.eye(3)


@dataclass(frozen=True)
class Contact:
    """One contact: normal force, N; outward normal n on the pin, in the pin's frame; angle, with n = cos e3 + sin e2 (for a ball
    atan2(n3, n1)). A ball also has an elevation out of the 1–3 plane. NaN without a normal force."""

    normal_force: float
    normal: np.ndarray
    angle: float
    elevation: float = NAN


@dataclass(frozen=True)
class Outcome:
    """Contacts of one sliding pair and their friction on the pin: along and about the axis, or the ball's torque."""

    contacts: list[Contact] = field(default_factory=list)
    force: float = 0.0
    torque: float | np.ndarray = 0.0


def pin_force(n: np.ndarray, arm: np.ndarray, omega: np.ndarray, sdot: np.ndarray, slope: float) -> np.ndarray:
    """Force on the pin per unit normal force: (117) + (119) as -n - mu_e v/|v|, v from (115), slope = mu_e/|v|."""
    v = -sdot - cross(omega, arm)
    return -n - slope * v


def journal(fc, mc, omega, sdot, radius, half_length, law: Law, thrust_radius: float = 0.0) -> Outcome:
    """Shaft (115)-(126) and journal (129)-(138): two lateral contacts at -c and +c from the pin's point.

    The lateral components of (122), (123) are linear in (f cos, f sin) of the contacts, which are found numerically.
    """
    slope = law.slope(np.hypot(sdot, radius * omega))
    places = [-half_length * E1, half_length * E1]

    def wrench(place, normal):
        arm = radius * normal
        f = pin_force(normal, arm, omega * E1, sdot * E1, slope)
        return np.concatenate([f, cross(place + arm, f)])

    lateral = np.column_stack([wrench(p, n) for p in places for n in (E3, E2)])
    # Each column is the wrench of a contact for f n = e3 or e2. Only its lateral rows are linear in f n, so the solver uses only
    # these rows.
    a1, b1, a2, b2 = np.linalg.solve(lateral[[1, 2, 4, 5]], np.concatenate([fc[1:], mc[1:]]))
    contacts = [_lateral(a1, b1), _lateral(a2, b2)]
    total = sum(c.normal_force * wrench(p, c.normal) for c, p in zip(contacts, places, strict=True))
    thrust = thrust_radius * abs(fc[0]) * slope * radius * omega
    return Outcome(contacts, float(total[0]), float(total[3] + thrust))


def _lateral(a: float, b: float) -> Contact:
    f = float(np.hypot(a, b))
    normal = (a * E3 + b * E2) / f if f > 0 else np.full(3, NAN)
    return Contact(f, normal, float(np.arctan2(b, a)) if f > 0 else NAN)


def ball(fc, omega, radius, law: Law) -> Outcome:
    """Ball (105)-(114): n and f_n from f_c = f_n (k omega x n - n), with k of (108) and the law at |v| = r |omega x n|. For a given
    k, (109) is linear in f_n n. The sliding rate s = |omega x n| is the root of a scalar equation."""
    fc, omega = np.asarray(fc, float), np.asarray(omega, float)
    if np.linalg.norm(fc) == 0.0:
        return Outcome([Contact(0.0, np.full(3, NAN), NAN)], 0.0, np.zeros(3))
    spin = skew(omega)

    def normal(s):
        k = radius * law.slope(radius * s)
        y = np.linalg.solve(k * spin - np.eye(3), fc)
        return y / np.linalg.norm(y), float(np.linalg.norm(y))

    def gap(s):
        return float(np.linalg.norm(cross(omega, normal(s)[0]))) - s

    s = _sliding_rate(gap, float(np.linalg.norm(omega)), law)
    if s is None:  # Nothing slides at the contact. The normal n lies along the spin, the limit of (104) for v_eps → 0.
        n = -np.sign(fc @ omega) * omega / np.linalg.norm(omega)
        fn = float(-n @ fc)
    else:
        n, fn = normal(s)
    torque = radius * cross(n, fc)  # torque by (110), because the normal part of f_c has no arm
    contact = Contact(fn, n, float(np.arctan2(n[2], n[0])), float(np.arcsin(np.clip(n[1], -1, 1))))
    return Outcome([contact], 0.0, torque)


def _sliding_rate(gap, top: float, law: Law) -> float | None:
    """Root of ``gap`` between 0 and |omega|. None if exact Coulomb friction has no root: the ball then spins about its normal."""
    if top == 0.0 or gap(top) >= -1e-15 * top:
        return top
    low = 0.0 if law.kind != "coulomb" else 1e-12 * top
    if gap(low) <= 0.0:
        return None if law.kind == "coulomb" else low
    return float(brentq(gap, low, top * (1 + 1e-15), xtol=1e-16 * top, rtol=8.9e-16, maxiter=500))


def sleeve(fc, mc, sdot, half_width, half_height, half_length, law: Law) -> Outcome:
    """Prismatic sleeve (theory, "Sleeve"): faces +-a e2 and +-b e3, ends at -c and +c, torsion as a couple.

    A contact is a signed force N along e2 or e3 on the loaded face of the inner part, with axial friction on this face.
    """
    slope = law.slope(abs(sdot))
    sites = [(x * E1, e, h) for e, h in ((E2, half_width), (E3, half_height)) for x in (-half_length, half_length)]

    def wrench(site, N):
        place, e, half = site
        n = -np.sign(N) * e
        f = abs(N) * pin_force(n, half * n, np.zeros(3), sdot * E1, slope)
        return np.concatenate([f, cross(place + half * n, f)])

    unit = np.column_stack([wrench(s, 1.0) for s in sites])
    N = np.linalg.solve(unit[[1, 2, 4, 5]], np.concatenate([fc[1:], mc[1:]]))
    total = sum(wrench(s, x) for s, x in zip(sites, N, strict=True))
    couple = abs(mc[0]) / max(half_width, half_height)
    contacts = [_face(x, s[1]) for s, x in zip(sites, N, strict=True)]
    contacts.append(Contact(float(couple), np.full(3, NAN), NAN))
    return Outcome(contacts, float(total[0] + slope * sdot * couple), 0.0)


def _face(N: float, e: np.ndarray) -> Contact:
    n = -np.sign(N) * e
    return Contact(abs(float(N)), n, float(np.arctan2(n[1], n[2])) if N else NAN)


def adams_ball(fc, omega, radius, law: Law) -> np.ndarray:
    """Adams' ball (151), with its normalisation: torque mu_e r |f| along the part of omega across f; |v| = r |omega x f| / |f|."""
    F = np.linalg.norm(fc)
    if F == 0.0:
        return np.zeros(3)
    across = cross(fc, cross(omega, fc)) / F**2
    return radius * law.slope(radius * np.linalg.norm(across)) * radius * F * across


def adams_journal(outcome: Outcome, fc, omega, sdot, radius, law: Law, axial: bool) -> Outcome:
    """Adams' journal (152): the reaction force is used as normal force; ``axial``: with the component along the axis."""
    slope = law.slope(np.hypot(sdot, radius * omega))
    F = np.linalg.norm(fc if axial else fc[1:])
    return replace(outcome, force=float(slope * sdot * F), torque=float(slope * radius * omega * radius * F))
