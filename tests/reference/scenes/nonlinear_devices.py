"""Random nonlinear springs and dampers, and the motion of a block on them by SciPy."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from tests.reference.mechanics.characteristic_curves import nonlinear
from trunnion.scene.data_classes import scene as sm

MOST = 12
"""Largest number of points of a curve."""


def spring_curve(rng: np.random.Generator, low: float = -1.0, high: float = 1.0) -> dict[str, Any]:
    """A spring curve with 2 to 12 points. It is monotone, or has falling parts as a disc spring has. At its ends the curve does not
    fall, because a motion could run away beyond a falling end."""
    n = int(rng.integers(2, MOST + 1))
    at = low + (high - low) * (np.sort(rng.uniform(0.0, 1.0, n)) + 0.05 * np.arange(n)) / (1.0 + 0.05 * n)
    effort = np.cumsum(rng.uniform(0.0, 1.0, n) ** 3) * 100.0 - 100.0 if rng.random() < 0.5 else rng.uniform(-100.0, 100.0, n)
    effort[0], effort[-1] = effort.min(), effort.max()
    return {"at": tuple(at.tolist()), "effort": tuple(effort.tolist())}


def damping_curve(rng: np.random.Generator) -> dict[str, Any]:
    """A damping curve. It is the same in both directions, or has one curve for each direction."""
    speed, effort = ([float(x) for x in np.cumsum(rng.uniform(0.1, 1.0, 5))] for _ in range(2))
    if rng.random() < 0.5:
        return {"speed": (0.0, *speed), "effort": (0.0, *effort)}
    back = rng.uniform(0.2, 3.0)
    below = {"speed": [-x for x in reversed(speed)], "effort": [-back * x for x in reversed(effort)]}
    return {"speed": (*below["speed"], 0.0, *speed), "effort": (*below["effort"], 0.0, *effort)}


def group(rng: np.random.Generator, damped: bool = True, **span: float) -> sm.Nonlinear:
    """A nonlinear spring and, if ``damped``, both kinds of dampers."""
    dampers = {"quadratic_damping": float(rng.uniform(0.0, 2.0)), "damping_curve": made(sm.DampingCurve, damping_curve(rng))}
    return sm.Nonlinear(spring_curve=made(sm.SpringCurve, spring_curve(rng, **span)), **(dampers if damped else {}))


def made(kind: type, keys: dict[str, Any]) -> Any:
    """An object of a scene class."""
    return kind(**keys)


def block(seed: int, damped: bool) -> sm.Scene:
    """A block on a rail, on random springs and dampers."""
    rng = np.random.default_rng(seed)
    start = sm.Start(q=float(rng.uniform(-1.0, 1.0)), qd=float(rng.uniform(-5.0, 5.0)))
    rail = sm.Joint("prismatic", "ground", "b", axis="x", spring=sm.Spring(50.0), nonlinear=group(rng, damped), start=start)
    body = sm.Body(mass=float(rng.uniform(0.5, 2.0)), inertia=(1.0, 1.0, 1.0))
    return sm.Scene({"b": body}, {"rail": rail}, "block", gravity=(0.0, 0.0, 0.0))


def integrated(scene: sm.Scene, times: np.ndarray) -> np.ndarray:
    """Position and speed of a ``block`` (2 × times)."""
    rail, mass = scene.joints["rail"], scene.bodies["b"].mass

    def slope(_: float, y: np.ndarray) -> list[float]:
        return [y[1], -(rail.spring.stiffness * y[0] + nonlinear(rail.nonlinear, y[0], y[1])[0]) / mass]

    start = [rail.start.q, rail.start.qd]
    return solve_ivp(slope, (times[0], times[-1]), start, "DOP853", times, rtol=1e-12, atol=1e-13, max_step=0.01).y
