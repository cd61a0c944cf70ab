"""Coulomb friction of one sliding pair as a function of its sliding direction: closed forms, for searches with millions of
evaluations. ``reference_selftest/test_mode_enumeration.py`` compares them with the contacts found as numerical roots
(``contact_roots.py``)."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, sqrt

import numpy as np

from tests.reference.contact_and_friction.friction_laws import is_adams, law_of
from tests.reference.contact_and_friction.joint_friction import ends_of, pair, pin_of
from tests.reference.mechanics.joint_constraints import directions
from tests.reference.mechanics.newton_euler_equations import Equations
from tests.reference.mechanics.rotation import cross


@dataclass(frozen=True)
class Pair:
    """One sliding pair (a universal joint has two): its joint, the freedoms of the pair, their places in η, their levers (m; 1 for
    a travel), its coefficients of friction, and its speed at the surface, m/s.

    load: force and torque on the part with the pin, in the pin's axes, as 6 x (1 + n_eta) columns; sign: 1 or, with the pin
    outboard, -1; kind: "journal", "sleeve" or "ball", with its sizes; turned: takes a ball's rates to the pin's axes (3 x 3).
    """

    joint: str
    freedoms: tuple[int, ...]
    places: tuple[int, ...]
    arms: tuple[float, ...]
    mu: float
    static: float
    speed: float
    kind: str
    sign: float
    load: np.ndarray
    sizes: tuple[float, ...]
    turned: np.ndarray

    @property
    def name(self) -> str:
        """The pair's joint, and the number of the journal of a universal joint."""
        return f"{self.joint}.{self.freedoms[0] + 1}"

    def friction(self, way, mu: float, x: np.ndarray) -> list[float]:
        """Friction on the inboard part along each freedom, for sliding along ``way`` with coefficient ``mu``, at x = [1, η]. way:
        rates of the pair's freedoms, of any length, not all zero."""
        load = (self.load @ x).tolist()
        if self.kind == "ball":
            m = _ball(load[:3], [self.sign * v for v in (self.turned @ way).tolist()], mu, *self.sizes)
            return [self.sign * v for v in (self.turned.T @ m).tolist()]
        surface = [w * a for w, a in zip(way, self.arms, strict=True)]
        speed = hypot(*surface)
        k = [mu * v / speed for v in surface]
        if self.kind == "sleeve":
            return [k[0] * _sleeve(load, self.sign * k[0], *self.sizes)]
        along, around = (self.sign * k[0], self.sign * k[1]) if len(k) == 2 else (0.0, self.sign * k[0])
        total = _journal(load, along, around, *self.sizes[:2])
        out = [v * a * total for v, a in zip(k, self.arms, strict=True)]
        if len(k) == 1:
            out[0] += k[0] * self.sizes[2] * abs(load[0])  # the axial force presses on the thrust face
        return out


def _journal(load, along: float, around: float, radius: float, half: float) -> float:
    """Sum of the normal forces at both ends of a shaft, with signed friction ratios along and around its axis (method: journal)."""
    _, f2, f3, _, m2, m3 = load
    turn = 1.0 + 1j * around
    both = -complex(f3, f2) / turn
    apart = -complex((m2 - along * radius * both.real) / half, -(m3 + along * radius * both.imag) / half) / turn
    return (abs(both + apart) + abs(both - apart)) / 2


def _sleeve(load, k: float, a: float, b: float, half: float) -> float:
    """Sum of all normal forces of a rectangular sleeve, including the forces of the couple that carries its torsion."""
    _, f2, f3, m1, m2, m3 = load
    u, v = (m3 - k * a * f2) / half, (m2 + k * b * f3) / half
    return (abs(f2 + u) + abs(f2 - u) + abs(f3 - v) + abs(f3 + v)) / 2 + abs(m1) / max(a, b)


def _ball(f, w, mu: float, radius: float) -> np.ndarray:
    """Torque on a ball with force f whose socket turns with w. The ball slides outside its cone; inside, it turns about its
    contact."""
    force, turn = sqrt(f[0] ** 2 + f[1] ** 2 + f[2] ** 2), sqrt(w[0] ** 2 + w[1] ** 2 + w[2] ** 2)
    if not force * turn > 0.0:
        return np.zeros(3)
    u, d = [x / force for x in f], [x / turn for x in w]
    along = sum(x * y for x, y in zip(u, d, strict=True))
    distance = 1.0 - along**2 * (1.0 + mu**2)
    if distance <= 0.0:
        return radius * force * cross([x if along < 0.0 else -x for x in d], u)
    k = mu / sqrt(distance)
    across = cross(d, u)
    n = [-(p + k * q + k * k * along * r) / (1.0 + k * k) for p, q, r in zip(u, across, d, strict=True)]
    size = sqrt(n[0] ** 2 + n[1] ** 2 + n[2] ** 2)
    return radius * force * cross([x / size for x in n], u)


def sliding_pairs(eq: Equations) -> list[Pair]:
    """The pairs of a scene. All joints must have Coulomb friction with exact contacts."""
    out: list[Pair] = []
    for name in dict.fromkeys(n for n, _ in eq.eta):
        joint, state = eq.state.scene.joints[name], eq.state
        law = law_of(state.scene, joint.friction)
        if law.kind != "coulomb" or is_adams(state.scene, joint.friction):
            raise NotImplementedError(f"{name}: only Coulomb's law with exact contacts is decided here")
        freedoms = tuple(k for n, k in eq.eta if n == name)
        crossed = joint.type == "universal"
        for ks in [(k,) for k in freedoms] if crossed else [freedoms]:
            g = joint.friction
            radius, half = pair(g.radius)[ks[0] if crossed else 0], pair(g.half_length)[ks[0] if crossed else 0]
            kind, sizes = {
                "spherical": ("ball", (radius,)),
                "prismatic": ("sleeve", (g.half_width, g.half_height, half)),
            }.get(joint.type, ("journal", (radius, half, g.thrust_radius or 0.0)))
            arms = tuple(1.0 if np.any(eq.free[name].F[k]) else radius for k in ks)
            places = tuple(eq.eta.index((name, k)) for k in ks)
            speed = float(np.linalg.norm(np.asarray(state.qd[name], float)[list(ks)] * arms))
            sign, load = _load(eq, name, ks[0] if crossed else None)
            static = law.mu if g.mu_static is None else g.mu_static
            out.append(Pair(name, ks, places, arms, law.mu, static, speed, kind, sign, load, sizes, _ball_axes(eq, name)))
    return out


def _load(eq: Equations, name: str, journal: int | None) -> tuple[float, np.ndarray]:
    """Wrench on the part with the pin, at its point in its axes. For a universal joint, the wrench is on the pin of one journal, in
    (axis, across, across). It includes the devices of the other axis, which the cross transmits."""
    press, pin, pose = eq.press(name), pin_of(eq.state, name), eq.state.joint_pose(name)
    if journal is None:
        arm = pose.p_out - ends_of(pose, eq.state.scene.joints[name])
        torque = press[3:] + np.cross(arm, press[:3], axisb=0, axisc=0)
        return pin.sign, pin.sign * np.vstack([pin.A.T @ press[:3], pin.A.T @ torque])
    C = directions(eq.state, name).T[3:]
    f, m = C @ press[:3], C @ press[3:]
    m[1 - journal] -= eq.devices(name)[1 - journal]
    sign, turn = pin.sign * (1.0 if journal == 0 else -1.0), [0, 1, 2] if journal == 0 else [1, 2, 0]
    return sign, sign * np.vstack([f[turn], m[turn]])


def _ball_axes(eq: Equations, name: str) -> np.ndarray:
    """Matrix that takes the rates of a ball's freedoms to the pin's axes (3 x 3)."""
    pose = eq.state.joint_pose(name)
    return pin_of(eq.state, name).A.T @ pose.A_in
