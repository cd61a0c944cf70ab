"""A driven slider-crank whose slider meets a stop. Its events and steps do not depend on the cut of the loop."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.default_case_selection import sampled
from tests.engine.checks.turned_mirrored_scaled_scenes import image, scaled
from tests.reference.mechanics.rotation import random_rotation
from trunnion import Scene, scene_from_dict, simulate

CUTS = ("crankpin", "gudgeon", "guide")
UNTIL = 1.0
STEPS = {"auto": 60, "rk5": 120, "rk8": 60, "rosenbrock": 100, "moreau": 2000}
"""Most steps of a run at a tolerance of 1e-4 or 1e-6."""


def driven_crank(rng: np.random.Generator) -> tuple[dict[str, Any], list[tuple[str, float]]]:
    """A slider-crank at a constant rate. Its slider has friction and meets a stiff stop. Returns (scene, its events by closed
    form)."""
    short, long, rate, angle = rng.uniform(0.05, 0.2), rng.uniform(0.25, 0.6), rng.uniform(5.0, 12.0), rng.uniform(-3.0, 3.0)
    at, masses = long + short * rng.uniform(-0.5, 0.9), rng.uniform(0.5, 2.0, 3)
    stops = {"stiffness": 10 ** rng.uniform(3.0, 7.0), "damping": rng.uniform(0.0, 0.2), "upper": at}
    rods = [{"mass": m, "center": [x / 2, 0, 0], "inertia": [m * x**2 / 12] * 3, "points": {"end": [x, 0, 0]}}
            for m, x in zip(masses, (short, long), strict=False)]  # fmt: skip
    lean = -math.asin(short * math.sin(angle) / long)
    starts = {"main": angle, "crankpin": lean - angle, "gudgeon": -lean,
              "guide": short * math.cos(angle) + long * math.cos(lean)}  # fmt: skip
    sides = (("ground", "crank"), ("crank.end", "rod"), ("rod.end", "piston"), ("ground", "piston"))
    joints: dict[str, dict[str, Any]] = {
        n: {"type": "prismatic" if n == "guide" else "revolute", "axis": "x" if n == "guide" else "z", "inboard": a, "outboard": b,
            "start": {"q": starts[n]}}
        for n, (a, b) in zip(starts, sides, strict=True)
    }  # fmt: skip
    joints["main"] |= {"drive": {"constant": {"rate": rate, "start": angle}}}
    joints["guide"] |= {"friction": {"force": 3.0}, "end_stops": stops}
    meets = brentq(lambda a: short * math.cos(a) + math.sqrt(long**2 - (short * math.sin(a)) ** 2) - at, 0.0, math.pi)
    turns = np.arange(-2, 6)
    angles = [("reversal", x) for x in np.pi * turns]
    angles += [(f"end_stop_{k}", 2 * np.pi * n + s * meets) for k, s in (("engaged", -1), ("released", 1)) for n in turns]
    events = sorted(((k, (a - angle) / rate) for k, a in angles if 0.0 < a - angle < rate * UNTIL), key=lambda e: e[1])
    bodies = {"crank": rods[0], "rod": rods[1], "piston": {"mass": masses[2], "inertia": [1e-3] * 3}}
    return {"schema": 1, "gravity": [0, -9.81, 0], "bodies": bodies, "joints": joints}, events


def cut_at(scene: dict[str, Any], joint: str) -> Scene:
    """The scene with its loop cut at this joint."""
    joints = {n: j | {"cut": True} if n == joint else j for n, j in scene["joints"].items()}
    return scene_from_dict(scene | {"joints": joints})


@pytest.mark.parametrize("first", sampled(range(100, 200, 5), 2))
def test_a_turned_crank_starts_wherever_its_loop_is_cut(first: int) -> None:
    """Round-off in the rows across the plane must not count as an equation. If it did, 7 % of such scenes would have no start
    rates."""
    for seed in range(first, first + 5):
        rng = np.random.default_rng(seed)
        scene, _ = driven_crank(rng)
        for cut in CUTS:
            turned = image(cut_at(scene, cut), random_rotation(rng))
            for made in (turned, scaled(turned, 1e3, 1.0, 1e3**0.5)):
                assert simulate(made, until=1e-6, kernel="parts", outputs="main.qd[1]").outcome.ok, (seed, cut)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", range(12))
@pytest.mark.slow
def test_a_driven_crank_reverses_its_slider_on_a_stop_wherever_the_loop_is_cut(seed: int) -> None:
    """At the reversal, terms of 1e6 N nearly cancel. The acceleration of 14 m/s² must not count as their error, because the slider
    would then stick."""
    rng = np.random.default_rng(seed)
    scene, events = driven_crank(rng)
    turn, kernel = random_rotation(rng), "compiled" if seed % 4 == 3 else "parts"
    for k, cut in enumerate(CUTS):
        own = cut_at(scene, cut)
        made, unit = ((own, 1.0), (image(own, turn), 1.0), (scaled(own, 1e3, 1.0, 1e3**0.5), 1e3**0.5))[(seed + k) % 3]
        for method, steps in STEPS.items():
            for rtol in (1e-4, 1e-6):
                r = simulate(made, until=UNTIL * unit, rtol=rtol, method=method, kernel=kernel, outputs="guide.q[1]")
                assert (r.outcome.name, r.audit.verdict) == ("done", "within")
                assert r.stats.steps <= steps * (10 if rtol < 1e-4 and method == "moreau" else 1)
                near = (100 if method == "moreau" else 3) * rtol
                assert [e.kind for e in r.events] == [k for k, _ in events]
                assert [e.time / unit for e in r.events] == pytest.approx([t for _, t in events], abs=near)
