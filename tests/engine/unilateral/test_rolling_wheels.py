"""Wheels that roll, slip and lock: on a curve, and with a brake on a slope."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from tests.engine.unilateral.unilateral_scenes import G, body, in_plane, scene
from trunnion.simulation.run import simulate


class Hill:
    """A wheel on a spline track, in the plane of z (e2) and x (e3). The points are places of the wheel's centre."""

    def __init__(self, rng: np.random.Generator):
        x = np.linspace(0.0, 3.0, 9)
        self.points = np.column_stack([0.3 * np.cos(x * rng.uniform(1.8, 2.6)) + 0.3 - 0.4 * x, x])
        self.radius, self.mass, self.part = rng.uniform(0.05, 0.15), rng.uniform(0.5, 3.0), rng.uniform(0.3, 1.0)
        self.mu, self.slip = rng.uniform(0.4, 0.8), rng.uniform(0.5, 2.0)
        u = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(self.points, axis=0).T))])
        self.curve = CubicSpline(u, self.points, bc_type="natural")
        self.begin = 0.4 * u[1]

    def scene(self) -> Any:
        track = {"type": "point_on_curve", "axis": [0, 1, 0], "reference": [0, 0, 1], "inboard": "ground", "outboard": "wheel"}
        track |= {"curve": {"points": self.points.tolist()}, "roller": self.radius, "friction": {"mu": self.mu}, "unilateral": {}}
        way = self.curve(self.begin, 1)
        v = self.slip * way / np.hypot(*way)
        fly = in_plane("wheel", (*self.curve(self.begin), 0.0), (*v, 0.0))
        return scene({"wheel": body(self.mass, self.part * self.mass * self.radius**2)}, {"fly": fly, "track": track})

    def rates(self, _: float, y: np.ndarray, rolls: bool) -> list[float]:
        """Rates of y = (parameter, speed along the track, rim speed ω R)."""
        c1, c2 = self.curve(y[0], 1), self.curve(y[0], 2)
        size = np.hypot(*c1)
        slope, bend = c1[0] / size, (c1[1] * c2[0] - c1[0] * c2[1]) / size**3
        push = self.mass * (G * c1[1] / size + bend * y[1] ** 2)
        if rolls:
            change = -G * slope / (1.0 + self.part)
            self.share = abs(change * self.part * self.mass / push) / self.mu
            return [y[1] / size, change, change]
        return [y[1] / size, -G * slope - self.mu * push / self.mass, self.mu * push / self.mass / self.part]

    def reference(self, until: float) -> tuple[float, np.ndarray, float]:
        """Time at which the wheel begins to roll (infinite if later than ``until``), state at ``until``, and largest share of
        friction during rolling."""

        def sliding(_: float, y: np.ndarray, __: bool) -> float:
            return y[1] - y[2]

        sliding.terminal = True  # type: ignore[attr-defined]
        how = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14, "max_step": 0.01}
        first = solve_ivp(self.rates, (0.0, until), [self.begin, self.slip, 0.0], args=(False,), events=sliding, **how)
        if not len(first.t_events[0]):
            return np.inf, first.y[:, -1], 0.0
        (t,) = first.t_events[0]
        then = solve_ivp(self.rates, (t, until), first.y_events[0][0], args=(True,), **how)
        share = 0.0
        for y in then.y.T:
            self.rates(0.0, y, True)
            share = max(share, self.share)
        return t, then.y[:, -1], share


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("seed", range(120))
def test_a_wheel_slips_and_then_rolls_along_a_curve_as_an_independent_integration_says(seed: int) -> None:
    h, until = Hill(np.random.default_rng(seed)), 0.5
    rolls, end, share = h.reference(until)
    r = simulate(h.scene(), until=until, rtol=1e-11, kernel="parts", method=("auto", "rk5", "rosenbrock")[seed % 3])
    assert r.outcome.ok, r.outcome
    sticks = [e.time for e in r.events if e.kind == "stick"]
    assert sticks[:1] == pytest.approx([rolls] if rolls < until else [], abs=1e-9)
    assert r.audit.verdict == "within"
    if share < 1.0:
        assert len(r.events) == (rolls < until)
        at = h.curve(end[0])
        assert [r["fly.q[1]"][-1], r["fly.q[2]"][-1]] == pytest.approx(at, abs=1e-9)
        assert r["fly.qd[3]"][-1] * h.radius == pytest.approx(end[2], abs=1e-8)


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("seed", range(120))
def test_a_wheel_with_a_brake_on_a_slope_rolls_locks_slides_and_stops_as_by_hand(seed: int) -> None:
    """The load rests on the wheel, and a carriage guides load and wheel along the slope. The ground transmits at most μ N r, with N
    = m' g / cos α of load and wheel. The brake torque is larger than this limit. The wheel therefore slips, locks, and slides until
    it stops."""
    rng = np.random.default_rng(seed)
    slope, mu, radius = rng.uniform(0.05, 0.3), rng.uniform(0.5, 0.9), rng.uniform(0.1, 0.4)
    carriage, load, wheel = rng.uniform(0.1, 0.5), rng.uniform(5, 20), rng.uniform(1, 5)
    inertia, v0, brakes = rng.uniform(0.4, 1.0) * wheel * radius**2, rng.uniform(2, 5), rng.uniform(0.1, 0.5)
    mass, push = carriage + load + wheel, (load + wheel) * G * np.cos(slope)
    torque = rng.uniform(1.2, 3.0) * mu * push * radius
    down, up = [np.cos(slope), 0.0, -np.sin(slope)], [np.sin(slope), 0.0, np.cos(slope)]
    joints: dict[str, Any] = {
        "rail": {"type": "prismatic", "axis": down, "inboard": "ground", "outboard": "carriage", "start": {"qd": v0}},
        "lift": {"type": "prismatic", "axis": up, "inboard": "carriage", "outboard": "load"},
        "hub": {"type": "revolute", "axis": [0, 1, 0], "inboard": "load", "outboard": "wheel", "start": {"qd": v0 / radius}},
    }
    joints["hub"]["friction"] = {"torque": {"step": {"begin": brakes, "start": 0.0, "end": torque}}}
    ends = [[-50.0, 0.0], [50.0, 0.0]]
    ground = {"body": "ground", "axis": [0, 1, 0], "reference": down}
    joints["tyre"] = {"type": "point_on_curve", "axis": [0, 1, 0], "inboard": ground, "outboard": "wheel"}
    joints["tyre"] |= {"curve": {"points": ends}, "roller": radius, "friction": {"mu": mu}, "unilateral": {}}
    bodies = {"carriage": body(carriage, 0.1), "load": body(load, 0.1), "wheel": body(wheel, inertia)}
    made = scene(bodies, joints)
    v1 = v0 + brakes * G * np.sin(slope) / (1.0 + inertia / mass / radius**2)
    slows = mu * push / mass - G * np.sin(slope)
    locks = brakes + v1 / radius * inertia / (torque - mu * push * radius)
    stops = brakes + v1 / slows
    r = simulate(made, until=stops + 0.1, rtol=1e-11, kernel="parts", method=("auto", "rk5", "rosenbrock")[seed % 3])
    assert r.outcome.ok, r.outcome
    found = [(e.kind, e.joint, e.time) for e in r.events]
    expected = [("slip", "tyre", brakes), ("stick", "hub", locks), ("stick", "tyre", stops)]
    assert [x[:2] for x in found] == [x[:2] for x in sorted(expected, key=lambda x: x[2])]
    assert [x[2] for x in found] == pytest.approx([x[2] for x in sorted(expected, key=lambda x: x[2])], abs=1e-9)
    way = v0 * brakes + 0.5 * (v1 - v0) * brakes + 0.5 * v1**2 / slows
    assert r["rail.q[1]"][-1] == pytest.approx(way, abs=1e-9)
    assert r.audit.verdict == "within"
