"""8.2's mechanism undriven and frictionless, 10 s: largest crank-angle error at t = 0.1 … 10 s against stepping time.

The reference is the closed form with one freedom, J(θ) θ̈ + ½ J'(θ) θ̇² + V'(θ) = 0. The script also measures runs of SciPy with
this closed form."""

from __future__ import annotations

import math
import time

import numpy as np
from scipy.integrate import solve_ivp

from tests.benchmarks.speed.processor_time import pin, repeat
from trunnion import load_scene
from trunnion.simulation.run import Model, run
from trunnion.simulation.runtime_interface.simulation_block import Settings

G, R, L, RHO = 9.81, 0.5, 1.0, 7801.0
M1, M2, M3 = RHO * 0.01 * R, RHO * 0.01 * L, RHO * 0.008
I1, I2 = M1 / 12 * (R * R + 0.01), M2 / 12 * (L * L + 0.01)


def acceleration(theta: float, omega: float) -> float:
    """θ̈ from Lagrange's equation; rod angle φ below the guide with sin φ = (R/L) sin θ."""
    s, c = math.sin(theta), math.cos(theta)
    k = R / L
    sp = k * s
    cp = math.sqrt(1 - sp * sp)
    f1 = k * c / cp
    f2 = (-k * s + sp * f1 * f1) / cp
    x1, x2 = -R * s - L * sp * f1, -R * c - L * (cp * f1 * f1 + sp * f2)
    u1, u2 = -R * s - L / 2 * sp * f1, -R * c - L / 2 * (cp * f1 * f1 + sp * f2)
    w1, w2 = R * c / 2, -R * s / 2
    inertia = I1 + M1 * R * R / 4 + M2 * (u1 * u1 + w1 * w1) + I2 * f1 * f1 + M3 * x1 * x1
    slope = 2 * (M2 * (u1 * u2 + w1 * w2) + I2 * f1 * f2 + M3 * x1 * x2)
    return -(0.5 * slope * omega * omega + G * (M1 * R / 2 * c + M2 * w1)) / inertia


def reference() -> np.ndarray:
    """θ at 0.1, 0.2, … 10 s, rad. The integration ends exactly at every sample and continues from the sample."""
    y, t, out = [0.0, 10.0], 0.0, []
    for k in range(1, 101):
        y = solve_ivp(lambda _t, y: [y[1], acceleration(*y)], (t, 0.1 * k), y, method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
        t = 0.1 * k
        out.append(y[0])
    return np.array(out)


def main() -> None:
    """Print the table."""
    pin()
    exact = reference()
    model = Model(load_scene("crank_slider_free"), ["crank_pivot.q[1]"])
    print(f"crank-slider, free, 10 s; build {model.build_seconds:.2f} s (0: from the cache)")
    print(f"{'method':22s} {'rtol':>7s} {'error rad':>10s} {'min ms':>8s} {'median':>8s} {'steps':>6s} {'evaluations':>11s}")
    for method in ("auto", "rk8", "rk5"):
        for rtol in (1e-6, 1e-7, 1e-8, 1e-9, 1e-10):
            settings = Settings(rtol=rtol, method=method)
            result = run(model, 10.0, 0.1, settings)
            low, middle = repeat(lambda settings=settings: run(model, 10.0, 0.1, settings).stats.wall_time)
            error = np.abs(result["crank_pivot.q[1]"][1:] - exact).max()
            s = result.stats
            wall = f"{low * 1e3:8.3f} {middle * 1e3:8.3f}"
            print(f"trunnion {method:13s} {rtol:7.0e} {error:10.1e} {wall} {s.steps:6d} {s.rhs_evaluations:11d}")
    for method in ("DOP853", "LSODA"):
        for rtol in (1e-6, 1e-8, 1e-10):

            def once(rtol=rtol, method=method):
                started = time.perf_counter()
                once.y = solve_ivp(
                    lambda _t, y: [y[1], acceleration(*y)],
                    (0, 10),
                    [0.0, 10.0],
                    method=method,
                    rtol=rtol,
                    atol=rtol,
                    t_eval=np.arange(1, 101) * 0.1,
                ).y[0]
                return time.perf_counter() - started

            low, middle = repeat(once, 3)
            print(f"scipy 1-dof {method:10s} {rtol:7.0e} {np.abs(once.y - exact).max():10.1e} {low * 1e3:8.3f} {middle * 1e3:8.3f}")


if __name__ == "__main__":
    main()
