"""Example 8.1 with the regularised law (v_eps 1e-4), 0–5 s: error of the angle at 5 s against stepping time, for Trunnion and
SciPy.

The reference is the planar pendulum in closed form (one quadratic equation), integrated piecewise between the kinks at 1e-13.
"""

from __future__ import annotations

import math
import time

import numpy as np
from scipy.integrate import solve_ivp

from tests.benchmarks.speed.processor_time import pin, repeat
from trunnion import load_scene
from trunnion.scene.overrides import apply
from trunnion.simulation.run import Model, run
from trunnion.simulation.runtime_interface.simulation_block import Settings

M, L, G, R, MU, V_EPS = 78.0, 0.5, 9.81, 0.05, 0.6, 1e-4
INERTIA = M * 1.01 / 12 + M * L * L
OMEGA_EPS = V_EPS / R


def alpha(theta: float, omega: float, regime: int = 0) -> float:
    """Angular acceleration; regime 0: by |ω|, ±1: saturated with that sign, 2: proportional. |T| = R_e |f_c| with
    R_e = r μ/√(1+μ²) in I α + m g l sinθ = −T makes one quadratic equation for α."""
    s = MU * omega / OMEGA_EPS if regime == 2 else MU * regime if regime else MU * max(-1.0, min(1.0, omega / OMEGA_EPS))
    q = R * M * s / math.sqrt(1 + s * s)
    sin, cos = math.sin(theta), math.cos(theta)
    gravity, tangential, radial = M * G * L * sin, G * sin, L * omega * omega + G * cos
    a, e = INERTIA**2 - q * q * L * L, INERTIA * tangential - L * gravity
    return (q * q * L * tangential - INERTIA * gravity - q * math.sqrt(e * e + a * radial * radial)) / a


def reference(until: float) -> float:
    """θ(until) in rad, integrated piecewise between the instants at which |ω| = v_eps/r."""
    t, y, regime = 0.0, np.array([math.pi / 2, 0.0]), 2
    while t < until - 1e-14:
        levels = [OMEGA_EPS, -OMEGA_EPS] if regime == 2 else [regime * OMEGA_EPS]
        events = []
        for level in levels:

            def event(_t, y, level=level):
                return y[1] - level

            event.terminal = True
            event.direction = (1 if level > 0 else -1) if regime == 2 else -regime
            events.append(event)
        s = solve_ivp(
            lambda _t, y, g=regime: [y[1], alpha(y[0], y[1], g)],
            (t, until),
            y,
            method="DOP853",
            rtol=1e-13,
            atol=1e-15,
            events=events,
            max_step=0.02,
        )
        t, y = s.t[-1], s.y[:, -1]
        if s.status == 1:
            hit = next(i for i, e in enumerate(s.t_events) if len(e))
            y[1] = levels[hit]
            regime = (1 if hit == 0 else -1) if regime == 2 else 2
    return float(y[0])


def main() -> None:
    """Print the table."""
    pin()
    exact = reference(5.0)
    scene = apply(load_scene("spherical_pendulum"), {"friction.law": "regularized", "friction.v_eps": V_EPS})
    model = Model(scene, ["ball.q*"])
    print(f"example 8.1 regularised, 0-5 s; reference angle {exact:.12f} rad; build {model.build_seconds:.2f} s (0: cached)")
    print(f"{'method':24s} {'rtol':>7s} {'error rad':>10s} {'min ms':>8s} {'median':>8s} {'steps':>6s} {'events':>6s}")
    for method in ("auto", "rk8", "rk5", "rosenbrock"):
        for rtol in (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9):
            settings = Settings(rtol=rtol, method=method)
            result = run(model, 5.0, 5.0, settings)
            low, middle = repeat(lambda settings=settings: run(model, 5.0, 5.0, settings).stats.wall_time)
            q = [result[f"ball.q[{i}]"][-1] for i in (1, 3)]
            theta = math.pi / 2 - abs(2 * math.atan2(q[1], q[0]))
            error = abs(abs(theta) - abs(exact))
            s = result.stats
            wall = f"{low * 1e3:8.3f} {middle * 1e3:8.3f}"
            print(f"trunnion {method:15s} {rtol:7.0e} {error:10.1e} {wall} {s.steps:6d} {s.events:6d}")
    for method in ("RK45", "DOP853", "LSODA", "Radau"):
        for rtol in (1e-5, 1e-7, 1e-9):

            def once(rtol=rtol, method=method):
                started = time.perf_counter()
                once.y = solve_ivp(
                    lambda _t, y: [y[1], alpha(y[0], y[1])], (0, 5), [math.pi / 2, 0], method=method, rtol=rtol, atol=rtol * 1e-2
                ).y[0, -1]
                return time.perf_counter() - started

            low, middle = repeat(once, 3)
            print(f"scipy {method:18s} {rtol:7.0e} {abs(once.y - exact):10.1e} {low * 1e3:8.3f} {middle * 1e3:8.3f}")


if __name__ == "__main__":
    main()
