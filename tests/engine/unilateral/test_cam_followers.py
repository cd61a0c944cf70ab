"""Above its float speed, a cam follower lifts off, flies and lands. The instants agree with an independent integration."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from tests.engine.unilateral.unilateral_scenes import body, scene
from trunnion.simulation.run import simulate

MASS, STIFF, SOON, SLOW = 0.3, 900.0, 1e-7, 0.02
"""SOON: time after an event from which the reference searches for the next event, s. SLOW: the reference ends when bounces are
slower than this, m/s."""
ANGLES = np.linspace(0.0, 2 * np.pi, 25)
RADII = 0.03 + 0.006 * np.exp(-8.0 * (1 - np.cos(ANGLES - np.pi)))
RADII[-1] = RADII[0]
LIFT = CubicSpline(ANGLES, RADII, bc_type="periodic")


def instants(speed: float, restitution: float, until: float) -> Iterator[tuple[str, float]]:
    """Events by SciPy of a mass on a spring that the cam carries. The contact opens where the normal force is 0, and closes where
    the gap is 0."""

    def at(t: np.ndarray | float, n: int = 0) -> np.ndarray:
        return LIFT(np.mod(-speed * t, 2 * np.pi), n) * (-speed) ** n

    def force(t: np.ndarray | float) -> np.ndarray:
        return MASS * at(t, 2) + STIFF * at(t)

    def gap(t: float, y: np.ndarray) -> float:
        return y[0] - float(at(t))

    def flight(_: float, y: np.ndarray) -> list[float]:
        return [y[1], -STIFF * y[0] / MASS]

    gap.terminal, gap.direction = True, -1  # type: ignore[attr-defined]
    grid, t = np.linspace(0.0, until, 4001), 0.0
    while True:
        later = grid[grid > t]
        pulls = later[force(later) < 0.0]
        if not len(pulls):
            return
        t = brentq(force, pulls[0] - grid[1], pulls[0], xtol=1e-15)
        yield "contact_opened", t
        q, v = float(at(t)), float(at(t, 1))
        while True:
            first = [q + SOON * v - 0.5 * SOON**2 * STIFF * q / MASS, v - SOON * STIFF * q / MASS]
            s = solve_ivp(flight, (t + SOON, until), first, "DOP853", events=gap, rtol=1e-13, atol=1e-15, max_step=1e-3)
            if not len(s.t_events[0]):
                return
            t, (q, v) = s.t_events[0][0], s.y_events[0][0]
            yield "contact_closed", t
            v = float(at(t, 1)) - restitution * (v - float(at(t, 1)))
            if restitution == 0.0 and force(t) >= 0.0:
                break
            if restitution and v - float(at(t, 1)) < SLOW:
                return


@pytest.mark.parametrize(("kind", "kernel"), [("cam", "parts"), ("flat_cam", "compiled")])
@pytest.mark.parametrize(("speed", "restitution"), [(60.0, 0.0), (110.0, 0.0), (110.0, 0.4)])
def test_a_follower_floats_and_lands_as_an_independent_integration_says(
    kind: str, kernel: str, speed: float, restitution: float
) -> None:
    until, face = 4 * np.pi / speed, kind == "flat_cam"
    shaft = {"type": "revolute", "inboard": "ground", "outboard": "cam", "axis": [0, 1, 0], "drive": {"constant": {"rate": speed}}}
    guide = {"type": "prismatic", "inboard": "ground", "outboard": "tappet", "axis": [0, 0, 1], "spring": {"stiffness": STIFF}}
    follows = {"body": "tappet", "axis": [0, 0, 1], "reference": [0, 1, 0]} if face else {"body": "tappet", "axis": [0, 1, 0]}
    touch = {"type": kind, "inboard": {"body": "cam", "axis": [0, 1, 0]}, "outboard": follows}
    touch["unilateral"] = {"restitution": restitution}
    touch["profile"] = {"angle": ANGLES.tolist(), "radius": RADII.tolist()}
    joints = {"shaft": shaft, "guide": guide, "touch": touch}
    made = scene({"cam": body(1.0, 1.0), "tappet": body(MASS, 0.1)}, joints, gravity=[0, 0, 0])
    r = simulate(made, until=until, rtol=1e-11, kernel=kernel)
    assert r.outcome.ok
    expected = list(instants(speed, restitution, until))
    found = [(e.kind, e.time) for e in r.events][: len(expected)]
    assert [k for k, _ in found] == [k for k, _ in expected]
    assert [t for _, t in found] == pytest.approx([t for _, t in expected], abs=1e-9)
    assert restitution or len(r.events) == len(expected)
    assert r.audit.verdict == "within"
