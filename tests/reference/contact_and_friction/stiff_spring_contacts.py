"""Rigid bodies connected by contacts that are stiff springs with friction. Where rigid joints do not determine their reactions, the
reactions are the limit of these contact forces for large stiffness.

Every body has a small displacement (three translations of its mass centre, three turns). The normal force of a contact is its
stiffness times the displacement of the pin against its bearing at the contact. The normal has the direction of this displacement,
and friction follows the sliding of the parts. No joint row carries a force: all equations of motion hold with contact forces alone.
Displacements do not change the geometry, so the solution is the limit itself. The unknowns are the displacements across the
mechanism's possible motions, and the accelerations along these motions. A universal joint is two journals on a massless cross. The
cross has its own displacement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from tests.reference.contact_and_friction.contact_roots import E1, E2, E3, pin_force
from tests.reference.contact_and_friction.friction_laws import Law, law_of
from tests.reference.contact_and_friction.joint_friction import ends_of, pair, pin_of, rates_of
from tests.reference.mechanics.bodies_and_joint_frames import GROUND, joint_frames
from tests.reference.mechanics.frictionless_contact_arms import arms
from tests.reference.mechanics.joint_constraints import directions
from tests.reference.mechanics.kinematics import State
from tests.reference.mechanics.newton_euler_equations import Equations, typical_length
from tests.reference.mechanics.rotation import cross
from trunnion.scene.data_classes.scene import Friction

USUAL = 1e8
"""Radial stiffness, N/m, of the contacts of a joint without its own. Only ratios count."""
FEW, MOST = 1, 5
"""Iterations during the increase of friction, and at its full value."""


@dataclass(frozen=True)
class Site:
    """A contact spring of a joint. Its place is in the pin's frame, relative to the pin's point. The site also has the axes of this
    frame along which it is loaded, and the outward arm of its friction along the normal. A site may be a face across the axis."""

    place: np.ndarray
    axes: tuple[np.ndarray, ...]
    arm: float
    face: bool = False


@dataclass(frozen=True)
class Fit:
    """A pin in its bearing. inner, outer: the parts that carry pin and bearing; A, point: frame and place of the pin, world; rates:
    of the bearing relative to the pin, in the pin's frame; k: stiffness of its springs; torsion: longer arm of a sleeve, else 0."""

    inner: str
    outer: str
    A: np.ndarray
    point: np.ndarray
    rates: np.ndarray
    sites: list[Site]
    k: float
    torsion: float = 0.0


def fits_of(state: State, name: str) -> list[Fit]:
    """The fits of a joint. The half length of a joint without friction is a tenth of its block's size."""
    joint, pose = state.scene.joints[name], state.joint_pose(name)
    if joint.type not in ("revolute", "spherical", "prismatic", "cylindrical", "universal"):
        raise NotImplementedError(f"{name}: no springs for a {joint.type} joint")
    g = joint.friction or Friction(**dict.fromkeys(("radius", "half_length", "half_width", "half_height"), _arm(state, name)))
    k = (joint.stiffness or USUAL) / USUAL
    if joint.type == "universal":
        return _journals(state, name, g, k)
    pin = pin_of(state, name)
    inner, outer = (pose.inboard, pose.outboard) if pin.sign > 0 else (pose.outboard, pose.inboard)
    torsion = max(g.half_width, g.half_height) if joint.type == "prismatic" else 0.0
    return [Fit(inner, outer, pin.A, ends_of(pose, joint), rates_of(state, name), sites_of(joint.type, g), k, torsion)]


def _journals(state: State, name: str, g: Friction, k: float) -> list[Fit]:
    """Two journals on a massless cross: about u1 on the inboard part, about u2 on the outboard part."""
    pose, C = state.joint_pose(name), directions(state, name).T[3:]
    fits = []
    for i, part in enumerate((pose.inboard, pose.outboard)):
        carried = state.scene.joints[name].pin == "inboard"
        inner, outer = (part, f"cross of {name}") if carried else (f"cross of {name}", part)
        turn = [0, 1, 2] if i == 0 else [1, 2, 0]
        rate = (1.0 if carried else -1.0) * (1.0 if i == 0 else -1.0) * state.qd[name][i]
        sites = [*_across(pair(g.radius)[i], pair(g.half_length)[i]), Site(np.zeros(3), (E1,), 0.0, True)]
        fits.append(Fit(inner, outer, C[turn].T, pose.p_out, np.r_[0.0, 0.0, 0.0, rate, 0.0, 0.0], sites, k))
    return fits


def _across(radius: float, half: float) -> list[Site]:
    return [Site(side * half * E1, (E2, E3), radius) for side in (-1, 1)]


def sites_of(kind: str, g: Friction) -> list[Site]:
    """The contact springs of a joint that consists of one fit."""
    if kind == "spherical":
        return [Site(np.zeros(3), (E1, E2, E3), g.radius)]
    if kind == "prismatic":
        return [Site(side * g.half_length * E1, (e,), h) for e, h in ((E2, g.half_width), (E3, g.half_height)) for side in (-1, 1)]
    across = _across(g.radius, g.half_length)
    return across if kind == "cylindrical" else [*across, Site(np.zeros(3), (E1,), g.thrust_radius or 0.0, True)]


def _arm(state: State, name: str) -> float:
    return arms(state.scene, {n: joint_frames(state.scene, j) for n, j in state.scene.joints.items()})[name]


class Compliant:
    """A scene at a state in which all joints with friction slide."""

    def __init__(self, state: State):
        self.state, self.eq = state, Equations(state)
        eq = self.eq
        self.fits = {name: fits_of(state, name) for name in state.scene.joints}
        crosses = [f"cross of {n}" for n, j in state.scene.joints.items() if j.type == "universal"]
        self.first = {b: 6 * i for b, i in eq.index.items()} | {c: 6 * (len(eq.index) + i) for i, c in enumerate(crosses)}
        self.center = {b: state.c[b] for b in eq.index} | {f"cross of {n}": fits[0].point for n, fits in self.fits.items()}
        self.bodies, self.size = 6 * len(eq.index), 6 * len(self.first)
        self.scale = np.abs(eq.f[:, 0]).max()
        self.normal_force: dict[str, list[float]] = {}

    def forces(self, delta: np.ndarray, share: float) -> np.ndarray:
        """Contact forces on all bodies and crosses (6 each: force, torque about the mass centre) for displacements delta."""
        out = np.zeros(self.size)
        for name, joint in self.state.scene.joints.items():
            law = law_of(self.state.scene, joint.friction) if joint.friction else Law("viscous")
            # the entry False holds contacts that the engine reports, the entry True faces and torsion
            loads: dict[bool, list[float]] = {False: [], True: []}
            for fit in self.fits[name]:
                for site in fit.sites:
                    loads[site.face].append(self._site(out, delta, fit, site, law, share))
                if fit.torsion:
                    loads[True].append(self._torsion(out, delta, fit, law, share))
            self.normal_force[name] = loads[False] + loads[True]
        return out

    def _site(self, out, delta, fit: Fit, site: Site, law: Law, share: float) -> float:
        """Force of one contact spring."""
        at = fit.point + fit.A @ site.place
        gap = fit.A.T @ (self._moved(delta, fit.inner, at) - self._moved(delta, fit.outer, at))
        u = fit.k * sum((e @ gap) * e for e in site.axes)
        f = float(np.linalg.norm(u))
        force, moment = self._contact(site, u / f if f > 0 else site.axes[0], f, fit.rates, law, share)
        self._apply(out, fit.inner, at, fit.A @ force, fit.A @ moment)
        self._apply(out, fit.outer, at, -fit.A @ force, -fit.A @ moment)
        return f

    @staticmethod
    def _contact(site: Site, n, f, rates, law, share) -> tuple[np.ndarray, np.ndarray]:
        """Force on the pin and torque about the site, in the pin's frame."""
        if site.face:
            slope = law.slope(abs(site.arm * rates[3]) or 1.0)
            torque = share * slope * site.arm**2 * rates[3] * E1 * f if site.arm else np.zeros(3)
            return -f * n, torque
        arm = site.arm * n
        slope = share * law.slope(float(np.linalg.norm(rates[:3] + cross(rates[3:], arm))))
        force = f * pin_force(n, arm, rates[3:], rates[:3], slope)
        return force, cross(arm, force)

    def _torsion(self, out, delta, fit: Fit, law: Law, share: float) -> float:
        """The couple on a sleeve's faces, by a spring at the longer arm. Returns the total force of the spring."""
        axis, rate = fit.A @ E1, fit.rates[0]
        force = fit.k * fit.torsion * (axis @ (self._turned(delta, fit.inner) - self._turned(delta, fit.outer)))
        axial = share * law.slope(abs(rate)) * rate * abs(force) * axis
        moment = -force * fit.torsion * axis
        self._apply(out, fit.inner, fit.point, axial, moment)
        self._apply(out, fit.outer, fit.point, -axial, -moment)
        return abs(force)

    def _turned(self, delta, body) -> np.ndarray:
        return np.zeros(3) if body == GROUND else delta[self.first[body] + 3 :][:3]

    def _moved(self, delta, body, point) -> np.ndarray:
        if body == GROUND:
            return np.zeros(3)
        at = self.first[body]
        return delta[at : at + 3] + cross(delta[at + 3 : at + 6], point - self.center[body])

    def _apply(self, out, body, point, F, T) -> None:
        if body != GROUND:
            at = self.first[body]
            out[at : at + 6] += np.r_[F, T + cross(point - self.center[body], F)]

    def solve(self, steps: int = 3) -> tuple[np.ndarray, np.ndarray]:
        """(accelerations [a_c, α] of all bodies, displacements). Friction grows from zero to its full value in ``steps`` steps."""
        eq, n = self.eq, self.bodies
        col = np.tile([1.0, 1.0, 1.0, *[1 / typical_length(self.state)] * 3], self.size // 6)
        null = col[:n, None] * eq.null
        within = np.linalg.svd(eq.null.T)[2][eq.null.shape[1] :].T * col[:n, None]
        inside = block_diag(within, np.diag(col[n:]))  # crosses have no inertia, so all their displacements are unknown
        rest = eq.u[:, 0]

        def residual(x, share):
            z, d = x[: null.shape[1]], x[null.shape[1] :]
            gap = self.forces(self.scale * (inside @ d), share)
            gap[:n] += eq.f[:, 0] - eq.M @ (rest + null @ z * self.scale)
            return col * gap / self.scale

        x = np.zeros(self.size)
        x[null.shape[1] :] = 1e-3
        for share in np.linspace(0.0, 1.0, steps + 1):
            for _ in range(MOST if share == 1.0 else FEW):  # Newton with central differences; linear without friction
                J = np.array([(residual(x + h, share) - residual(x - h, share)) / 2e-7 for h in 1e-7 * np.eye(len(x))]).T
                x = x - np.linalg.solve(J, residual(x, share))
        self.residual = float(np.abs(residual(x, 1.0)).max())
        return rest + null @ x[: null.shape[1]] * self.scale, self.scale * (inside @ x[null.shape[1] :])[:n]
