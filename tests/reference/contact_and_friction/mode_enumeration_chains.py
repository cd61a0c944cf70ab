"""The joints that stick and slip, found by trying all combinations. It covers dry friction in chains of single freedoms, without
the engine."""

from __future__ import annotations

from itertools import product

import numpy as np
from scipy.optimize import fsolve

from tests.reference.contact_and_friction.joint_friction import Rubbing
from tests.reference.mechanics.kinematics import forward
from tests.reference.mechanics.newton_euler_equations import Equations

HAIR = 1e-9
"""Rate of a joint at rest that states the direction in which it slips, rad/s or m/s; all its other effects are as small."""
SLACK = 1e-7
"""Allowed excess of friction over its limit, or acceleration of a slipping joint in the wrong direction, relative to the largest of
each."""

UNBOUNDED = 1e4
"""A friction above this multiple of the friction under the loads alone is near a pole, where friction grows without bound. Such a
friction is no answer."""


def answers(scene, q, qd, starts: int = 20, spread: float = 3.0, seed: int = 0) -> list[dict[str, int]]:
    """Every consistent choice (0: sticks, ±1: slips in this direction) for the joints at rest; all other joints slide in the
    direction of their rates. Each joint has one freedom and one coefficient of friction. The search for roots begins from
    ``starts`` random values; ``spread`` is their size in units of friction."""
    rest = [n for n, v in qd.items() if np.all(np.asarray(v) == 0.0)]
    found: list[dict[str, int]] = []
    rng = np.random.default_rng(seed)
    for choice in product((0, 1, -1), repeat=len(rest)):
        modes = dict(zip(rest, choice, strict=True))
        moving = {n: np.array([HAIR * (modes[n] or 1)]) if n in modes else np.asarray(v) for n, v in qd.items()}
        chain = _Chain(Equations(forward(scene, q, moving)))
        if any(_fits(chain, modes, eta) for eta in _roots(chain, modes, starts, spread, rng)):
            found.append(modes)
    return found


class _Chain:
    """Accelerations caused by the frictions eta at one state. Quantities that depend only on the state are computed once. names:
    the joint of each friction."""

    def __init__(self, eq: Equations):
        self.names = [n for n, _ in eq.eta]
        self.joints = [(Rubbing(eq.state, n), eq.press(n), eq.devices(n), k) for n, k in eq.eta]
        self.rows = np.array([eq.accelerations(n)[k] for n, k in eq.eta])

    def law(self, eta: np.ndarray) -> np.ndarray:
        """Friction of every joint if it slid, under the forces that eta causes."""
        x = np.concatenate([(1.0,), eta])
        return np.array([rubbing.friction(press @ x, devices @ x)[0][k] for rubbing, press, devices, k in self.joints])

    def accelerations(self, eta: np.ndarray) -> np.ndarray:
        """Accelerations of all freedoms with friction."""
        return self.rows[:, 0] + self.rows[:, 1:] @ eta


def _roots(chain: _Chain, modes: dict[str, int], starts: int, spread: float, rng) -> list[np.ndarray]:
    """Friction values from many starts. With these values, sticking joints do not accelerate and slipping joints obey their law."""
    stuck, none = np.array([modes.get(n) == 0 for n in chain.names]), np.zeros(len(chain.names))
    unit = max(float(np.abs(chain.law(none)).max()), 1e-9)
    rate = max(float(np.abs(chain.accelerations(none)).max()), 1e-9)

    def lack(y: np.ndarray) -> np.ndarray:
        return np.where(stuck, chain.accelerations(y * unit) / rate, y - chain.law(y * unit) / unit)

    out: list[np.ndarray] = []
    for i in range(starts):
        y, _, ok, _ = fsolve(lack, spread * rng.normal(size=len(none)) * (i > 0), xtol=1e-12, full_output=True)
        if ok == 1 and np.abs(lack(y)).max() <= 1e-9 * (1 + np.abs(y).max()) and np.abs(y).max() < UNBOUNDED:
            out.append(y * unit)
    return out


def _fits(chain: _Chain, modes: dict[str, int], eta: np.ndarray) -> bool:
    """True if sticking joints need less than their friction of sliding, and slipping joints accelerate in the direction of their
    slip."""
    most, acc = np.abs(chain.law(eta)), chain.accelerations(eta)
    for i, n in enumerate(chain.names):
        if modes.get(n) == 0 and abs(eta[i]) > most[i] * (1 + SLACK):
            return False
        if modes.get(n) and acc[i] * modes[n] < -SLACK * np.abs(acc).max():
            return False
    return True
