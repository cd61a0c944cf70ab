"""Results of SciPy and plain linear algebra at rows 23 to 28 of the gallery: roots that fold away, shared loads and marginal
events."""

from __future__ import annotations

import math
import warnings
from dataclasses import replace

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

from tests.benchmarks.stability_gallery.scipy_results_rows_1_to_21 import ours
from tests.stability.entries.doors_and_marginal_stop import BLOCK, MU_TABLE, SPRING, G, crooked
from tests.stability.entries.self_tightening_brakes import ARM, GRIPS, LEAVES, MU, PRESS, REACH
from tests.stability.entries.toggle_press import folding
from tests.stability.entries.wishbone_and_platform import lifted, platform
from trunnion import simulate
from trunnion.analysis.mechanics.linearization import state_names
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import Model


def fold() -> str:
    """Row 23: the force across the shaft, followed from root to root as the torque falls."""

    def lack(y, torque: float):
        return ARM * y - torque - REACH * np.sqrt(np.maximum(y * y - (MU * PRESS) ** 2, 0.0))

    root = 2 * LEAVES / ARM
    for torque in np.linspace(1.2 * LEAVES, 0.9 * GRIPS, 500):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            (root,), found, code, _ = fsolve(lack, root, args=(torque,), full_output=True)
        if code != 1:
            left = abs(found["fvec"][0]) / torque
            at = f"{torque / GRIPS:.4f} of the threshold"
            return f"fsolve, following the root: no root from {at} on (code {code}, {left:.1g} of the torque left)"
    return "fsolve, following the root, goes over to the other one without a word"


def door() -> str:
    """Row 24: reactions of least norm."""
    return f"reactions of least norm, N and N m alike: friction {crooked():.0f} times that of equal contacts"


def marginal() -> str:
    """Row 25: both sides of the threshold, with the regularised law. The position ten seconds after the block has come to rest."""
    most, ends = MU_TABLE * G * BLOCK / SPRING, []
    for beyond in (-1e-6, 1e-6):

        def rate(_t: float, y) -> list[float]:
            return [y[1], -SPRING / BLOCK * y[0] - MU_TABLE * G * float(np.clip(y[1] / 1e-4, -1, 1))]

        half = math.pi * math.sqrt(BLOCK / SPRING)
        s = solve_ivp(rate, (0.0, half + 10.0), [3 * (1 + beyond) * most, 0.0], "Radau", rtol=1e-8, atol=1e-12)
        ends.append(1000 * (s.y[0, -1] + most))
    crept = f"has crept {ends[0]:.2f} and {ends[1]:.2f} mm in 10 s"
    return f"regularised at 1e-4 m/s: on both sides it neither stops nor reverses, and {crept}"


def smoothed(scene: sm.Scene) -> sm.Scene:
    """The scene with the regularised law."""
    law = sm.FrictionDefaults(law="regularized", v_eps=1e-4)
    joints = {n: replace(j, friction=j.friction and replace(j.friction, law="regularized")) for n, j in scene.joints.items()}
    return replace(scene, joints=joints, friction=law)


def wishbone() -> str:
    """Row 26, below the threshold: our equations with the regularised law, with SciPy's integrator for stiff equations."""
    rate, start = ours(smoothed(lifted(-1e-6)))
    s = solve_ivp(rate, (0.0, 1.0), start, "Radau", rtol=1e-6, atol=1e-9)
    crept = 1e3 * abs(s.y[0, -1] - start[0])
    how = f"creeps {crept:.2g} mrad in 1 s ({s.nfev} evaluations)"
    return f"Radau on our equations, regularised at 1e-4 m/s: the corner, which should rest, {how}"


def stewart() -> str:
    """Row 27: from rest, with the equations, law and integrator of row 26. The distance of the legs from their positions with exact
    friction."""
    scene = smoothed(platform(6, 0.3))
    rate, start = ours(scene)
    s = solve_ivp(rate, (0.0, 0.3), start, "Radau", rtol=1e-6, atol=1e-9)
    exact, legs = simulate(platform(6, 0.3), until=0.3, every=0.3), [f"leg{k}.q[1]" for k in range(6)]
    found = dict(zip(state_names(Model(scene)), s.y[:, -1], strict=False))
    off = 1e6 * max(abs(found[n] - exact[n][-1]) for n in legs if n in found)
    return f"Radau on our equations, regularised at 1e-4 m/s: legs are {off:.2g} µm off after 0.3 s ({s.nfev} evaluations)"


def toggle() -> str:
    """Row 28: our equations of the press, with exact friction."""
    ends = []
    for method in ("RK45", "Radau"):
        rate, start = ours(folding(1.0))
        last = 0.0

        def noted(t: float, y, rate=rate):
            nonlocal last
            last = max(last, t)
            return rate(t, y)

        try:
            s = solve_ivp(noted, (0.0, 1.0), start, method, rtol=1e-6, atol=1e-9)
            ends.append(f"{method} cannot shorten its step further at {s.t[-1]:.4f} s ({s.nfev} evaluations)")
        except RuntimeError:
            ends.append(f"{method} reaches a state without a friction solution at {last:.4f} s")
    return f"our equations, right end 0.5378 s: {'; '.join(ends)}"


BY_ITSELF = (24,)
STATEMENTS = {23: fold, 24: door, 25: marginal, 26: wishbone, 27: stewart, 28: toggle}
