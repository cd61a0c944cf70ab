"""Rigid bodies held together by contacts that are stiff springs with friction: where rigid joints leave reactions open, theirs are
the limit of these for large stiffness.

Every body is given a small displacement (three translations of its mass centre, three turns). A contact is pressed with the
stiffness times the displacement of the pin there against its bearing; its normal is the direction of that displacement, its
friction follows the sliding of the parts. No joint row carries a force: all equations of motion hold with contact forces alone.
Displacements do not act back on the geometry, which makes the solution the limit itself. Unknown are displacements across the
mechanism's motions and the accelerations along them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import root

from engine.scene.model import Friction

from .bodies import GROUND
from .contacts import E1, E2, E3, pin_force
from .equations import Equations, typical_length
from .kinematics import State
from .laws import Law, law_of
from .rotation import cross
from .rubbing import pin_of, rates_of


@dataclass(frozen=True)
class Site:
    """A contact spring of a joint: where it is (pin's frame, from the pin's point), along which axes of that frame it is pressed,
    how far its friction acts outward along the normal, and whether it is a face across the axis."""

    place: np.ndarray
    axes: tuple[np.ndarray, ...]
    arm: float
    face: bool = False


def sites_of(state: State, name: str) -> list[Site]:
    """The contact springs of a joint; of one without friction with a tenth of its parts' radius of gyration for its half length."""
    joint = state.scene.joints[name]
    if joint.type not in ("revolute", "spherical", "prismatic", "cylindrical"):
        raise NotImplementedError(f"{name}: no springs for a {joint.type} joint")
    g = joint.friction or Friction(**dict.fromkeys(("radius", "half_length", "half_width", "half_height"), _arm(state, name)))
    if joint.type == "spherical":
        return [Site(np.zeros(3), (E1, E2, E3), g.radius)]
    ends = [-g.half_length * E1, g.half_length * E1]
    if joint.type == "prismatic":
        return [Site(p, (e,), h) for e, h in ((E2, g.half_width), (E3, g.half_height)) for p in ends]
    across = [Site(p, (E2, E3), g.radius) for p in ends]
    return across if joint.type == "cylindrical" else [*across, Site(np.zeros(3), (E1,), g.thrust_radius or 0.0, True)]


def _arm(state: State, name: str) -> float:
    pose = state.joint_pose(name)
    bodies = [state.parts[b] for b in (pose.inboard, pose.outboard) if b != GROUND]
    return 0.1 * float(np.sqrt(np.mean([np.trace(b.inertia) / 2 / b.mass for b in bodies])))


class Compliant:
    """A scene at a state in which all that rubs slides."""

    def __init__(self, state: State):
        self.state, self.eq = state, Equations(state)
        eq = self.eq
        self.size = 6 * len(eq.index)
        self.scale = np.abs(eq.f[:, 0]).max()
        self.normal_force: dict[str, list[float]] = {}

    def forces(self, delta: np.ndarray, share: float) -> np.ndarray:
        """Contact forces on all bodies (6 each: force, torque about the mass centre) for displacements delta."""
        out = np.zeros(self.size)
        for name, joint in self.state.scene.joints.items():
            pin, pose, rates = pin_of(self.state, name), self.state.joint_pose(name), rates_of(self.state, name)
            law = law_of(self.state.scene, joint.friction) if joint.friction else Law("viscous")
            inner, outer = (pose.inboard, pose.outboard) if pin.sign > 0 else (pose.outboard, pose.inboard)
            loads = []
            for site in sites_of(self.state, name):
                at = pin.point + pin.A @ site.place
                gap = pin.A.T @ (self._moved(delta, inner, at) - self._moved(delta, outer, at))
                u = sum((e @ gap) * e for e in site.axes)
                f = float(np.linalg.norm(u))
                n = u / f if f > 0 else site.axes[0]
                loads.append(f)
                force, moment = self._contact(site, n, f, rates, law, share)
                F, T = pin.A @ force, pin.A @ moment
                self._apply(out, inner, at, F, T)
                self._apply(out, outer, at, -F, -T)
            if joint.type == "prismatic":
                arm = max(joint.friction.half_width, joint.friction.half_height) if joint.friction else _arm(self.state, name)
                loads.append(self._torsion(out, delta, pin, inner, outer, arm, rates, law, share))
            self.normal_force[name] = loads
        return out

    @staticmethod
    def _contact(site: Site, n, f, rates, law, share) -> tuple[np.ndarray, np.ndarray]:
        """Force on the pin and torque about the site, pin's frame."""
        if site.face:
            slope = law.slope(abs(site.arm * rates[3]) or 1.0)
            torque = share * slope * site.arm**2 * rates[3] * E1 * f if site.arm else np.zeros(3)
            return -f * n, torque
        arm = site.arm * n
        slope = share * law.slope(float(np.linalg.norm(rates[:3] + cross(rates[3:], arm))))
        force = f * pin_force(n, arm, rates[3:], rates[:3], slope)
        return force, cross(arm, force)

    def _torsion(self, out, delta, pin, inner, outer, arm, rates, law, share) -> float:
        """The couple on a sleeve's faces: a spring at the longer arm. Returns its total force."""
        turn = E1 @ pin.A.T @ (self._turned(delta, inner) - self._turned(delta, outer))
        force = arm * turn
        axial = share * law.slope(abs(rates[0])) * rates[0] * abs(force) * (pin.A @ E1)
        moment = -force * arm * (pin.A @ E1)
        self._apply(out, inner, pin.point, axial, moment)
        self._apply(out, outer, pin.point, -axial, -moment)
        return abs(force)

    def _turned(self, delta, body) -> np.ndarray:
        return np.zeros(3) if body == GROUND else delta[6 * self.eq.index[body] + 3 :][:3]

    def _moved(self, delta, body, point) -> np.ndarray:
        if body == GROUND:
            return np.zeros(3)
        at = 6 * self.eq.index[body]
        return delta[at : at + 3] + cross(delta[at + 3 : at + 6], point - self.state.c[body])

    def _apply(self, out, body, point, F, T) -> None:
        if body != GROUND:
            at = 6 * self.eq.index[body]
            out[at : at + 6] += np.r_[F, T + cross(point - self.state.c[body], F)]

    def solve(self, steps: int = 8) -> tuple[np.ndarray, np.ndarray]:
        """(accelerations [a_c, α] of all bodies, displacements): friction is let grow from none in so many steps."""
        eq = self.eq
        L = typical_length(self.state)
        col = np.tile([1.0, 1.0, 1.0, 1 / L, 1 / L, 1 / L], len(eq.index))
        null = col[:, None] * eq.null
        inside = np.linalg.svd(eq.null.T)[2][eq.null.shape[1] :].T * col[:, None]
        rest = eq.u[:, 0]

        def residual(x, share):
            z, d = x[: null.shape[1]], x[null.shape[1] :]
            gap = eq.f[:, 0] + self.forces(self.scale * (inside @ d), share) - eq.M @ (rest + null @ z * self.scale)
            return col * gap / self.scale

        x = np.zeros(self.size)
        x[null.shape[1] :] = 1e-3
        for share in np.linspace(0.0, 1.0, steps + 1):
            found = root(residual, x, args=(share,), method="hybr", options={"xtol": 1e-14, "maxfev": 100000})
            x = found.x
        for _ in range(4):  # polish: Newton with central differences
            J = np.array([(residual(x + h, 1.0) - residual(x - h, 1.0)) / 2e-7 for h in 1e-7 * np.eye(len(x))]).T
            x = x - np.linalg.solve(J, residual(x, 1.0))
        self.residual = float(np.abs(residual(x, 1.0)).max())
        return rest + null @ x[: null.shape[1]] * self.scale, self.scale * (inside @ x[null.shape[1] :])
