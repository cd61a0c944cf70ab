"""The friction of all joints together. It is the root of the complement equations that grows continuously from zero friction."""

from __future__ import annotations

import numpy as np
from scipy.optimize import root

from tests.reference.contact_and_friction.joint_friction import Rubbing, pair
from tests.reference.mechanics.newton_euler_equations import Equations

FAR = 1e6
"""An apparent root with more than this multiple of the force without friction counts as a root at infinity."""


class NoRoot(ArithmeticError):
    """The continuation from eta = 0 reaches no root of the complement equations."""


class Complement:
    """The complement equations eta - friction(transmitted wrenches at eta) = 0, in units of the forces that act without friction.

    The unknowns are y = eta/unit. ``scale`` is the share of friction in every joint (for the continuation).
    """

    def __init__(self, eq: Equations):
        self.eq, self.state = eq, eq.state
        self.names = list(dict.fromkeys(n for n, _ in eq.eta))
        self.rubbing = {n: Rubbing(eq.state, n) for n in self.names}
        self.press = {n: eq.press(n) for n in self.names}
        self.devices = {n: eq.devices(n) for n in self.names}
        loads = [np.abs(eq.press(n)[:3, 0]).max() for n in self.names]
        force = max([*loads, 1e-12])
        self.unit = np.array([force * self._arm(n, k) for n, k in eq.eta])

    def _arm(self, name: str, k: int) -> float:
        """Lever of freedom k of a joint: the radius, m, for a turn, and 1 for a travel."""
        if np.any(self.eq.free[name].F[k]):
            return 1.0
        return max(pair(self.state.scene.joints[name].friction.radius))

    def friction(self, eta: np.ndarray, scale: float) -> np.ndarray:
        """Friction of all joints by their laws, from the transmitted forces at ``eta``."""
        x = np.r_[1.0, eta]
        return np.concatenate([self.rubbing[n].friction(self.press[n] @ x, self.devices[n] @ x, scale)[0] for n in self.names])

    def residual(self, y: np.ndarray, scale: float = 1.0) -> np.ndarray:
        """Residual of the complement equations at y, in units of ``unit``."""
        eta = y * self.unit
        return (eta - self.friction(eta, scale)) / self.unit

    def root_near(self, y: np.ndarray, scale: float = 1.0) -> np.ndarray | None:
        """The root that a solver finds from y, polished to round-off; None if the solver finds no root."""
        found = root(self.residual, y, args=(scale,), method="hybr", options={"xtol": 1e-14})
        y = found.x
        for _ in range(3):
            worst, size = np.max(np.abs(self.residual(y, scale))), max(1.0, np.max(np.abs(y)))
            if worst <= 1e-13 * size:
                break
            y = self._polished(y, scale)
        return y if worst <= 1e-11 * size and size < FAR else None

    def _polished(self, y: np.ndarray, scale: float) -> np.ndarray:
        """One Newton step with central differences. The step is kept only if it reduces the residual."""
        r, h = self.residual(y, scale), 1e-6
        cols = [(self.residual(y + h * e, scale) - self.residual(y - h * e, scale)) / (2 * h) for e in np.eye(len(y))]
        try:
            z = y - np.linalg.solve(np.array(cols).T, r)
        except np.linalg.LinAlgError:
            return y
        return z if np.max(np.abs(self.residual(z, scale))) < np.max(np.abs(r)) else y


def connected_root(eq: Equations, stages: int = 2) -> np.ndarray:
    """eta of the root that grows from eta = 0 as friction is raised from zero (natural continuation)."""
    if not eq.eta:
        return np.zeros(0)
    problem = Complement(eq)
    y, done, step = np.zeros(len(eq.eta)), 0.0, 1.0 / stages
    while done < 1.0:
        goal = min(done + step, 1.0)
        found = problem.root_near(y, goal)
        if found is None:
            step /= 2
            if step < 1e-3:
                raise NoRoot(f"no root of the complement equations beyond {done:.3f} of the friction")
        else:
            y, done = found, goal
    return y * problem.unit


def all_roots(eq: Equations, starts: int = 30, seed: int = 0, spread: float = 3.0) -> list[np.ndarray]:
    """All different roots that are found from zero friction and from random starts of size ``spread``."""
    problem, rng, roots = Complement(eq), np.random.default_rng(seed), []
    for i in range(starts):
        y = problem.root_near(spread * rng.normal(size=len(eq.eta)) * (i > 0))
        if y is not None and not any(np.allclose(y, z, rtol=1e-6, atol=1e-8) for z in roots):
            roots.append(y)
    return [y * problem.unit for y in roots]
