"""Which joints stick and which slip, by trying everything: dry friction in chains of single freedoms, without the engine."""

from __future__ import annotations

from itertools import product

import numpy as np
from scipy.optimize import fsolve

from .equations import Equations
from .kinematics import forward
from .rubbing import Rubbing

HAIR = 1e-9
"""Rate given to a joint at rest to say which way it slips, rad/s or m/s; all else that it changes is as small."""
SLACK = 1e-7
"""How far friction may exceed what it can be, or a slipping joint accelerate the wrong way, relative to the largest of each."""


def answers(scene, q, qd, starts: int = 20, spread: float = 3.0, seed: int = 0) -> list[dict[str, int]]:
    """Every consistent choice (0 sticks, ±1 slips that way) for the joints at rest, all others sliding as they move. Each has one
    freedom and rubs with one coefficient. Roots are looked for from ``starts`` random values, ``spread`` in units of friction."""
    rest = [n for n, v in qd.items() if np.all(np.asarray(v) == 0.0)]
    found: list[dict[str, int]] = []
    rng = np.random.default_rng(seed)
    for choice in product((0, 1, -1), repeat=len(rest)):
        modes = dict(zip(rest, choice, strict=True))
        moving = {n: np.array([HAIR * (modes[n] or 1)]) if n in modes else np.asarray(v) for n, v in qd.items()}
        eq = Equations(forward(scene, q, moving))
        if any(_fits(eq, modes, eta) for eta in _roots(eq, modes, starts, spread, rng)):
            found.append(modes)
    return found


def _law(eq: Equations, eta: np.ndarray) -> np.ndarray:
    """Friction of every joint if it slid, in the forces that eta brings about."""
    x = np.r_[1.0, eta]
    return np.array([Rubbing(eq.state, n).friction(eq.press(n) @ x, eq.devices(n) @ x)[0][k] for n, k in eq.eta])


def _accelerations(eq: Equations, eta: np.ndarray) -> np.ndarray:
    return np.array([(eq.accelerations(n) @ np.r_[1.0, eta])[k] for n, k in eq.eta])


def _roots(eq: Equations, modes: dict[str, int], starts: int, spread: float, rng) -> list[np.ndarray]:
    """Friction values with which what sticks does not accelerate and what slips obeys its law, from many starts."""
    stuck = np.array([modes.get(n) == 0 for n, _ in eq.eta])
    unit = max(float(np.abs(_law(eq, np.zeros(len(eq.eta)))).max()), 1e-9)
    rate = max(float(np.abs(_accelerations(eq, np.zeros(len(eq.eta)))).max()), 1e-9)

    def lack(y: np.ndarray) -> np.ndarray:
        return np.where(stuck, _accelerations(eq, y * unit) / rate, y - _law(eq, y * unit) / unit)

    out: list[np.ndarray] = []
    for i in range(starts):
        y, _, ok, _ = fsolve(lack, spread * rng.normal(size=len(eq.eta)) * (i > 0), xtol=1e-12, full_output=True)
        if ok == 1 and np.abs(lack(y)).max() <= 1e-9 * (1 + np.abs(y).max()):
            out.append(y * unit)
    return out


def _fits(eq: Equations, modes: dict[str, int], eta: np.ndarray) -> bool:
    """Whether what sticks is held by less than its friction if it slid, and what slips does so the way it accelerates."""
    most, acc = np.abs(_law(eq, eta)), _accelerations(eq, eta)
    for i, (n, _) in enumerate(eq.eta):
        if modes.get(n) == 0 and abs(eta[i]) > most[i] * (1 + SLACK):
            return False
        if modes.get(n) and acc[i] * modes[n] < -SLACK * np.abs(acc).max():
            return False
    return True
