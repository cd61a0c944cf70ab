"""Platforms on three sprung legs (revolute, guide, ball). At the start all balls lie in one plane. In this position only, some legs
rest because other legs rest. Legs that almost rest move with the platform. If the engine stopped these legs for good, the platform
would lose a hundredth of its energy or jam."""

from __future__ import annotations

import numpy as np
import pytest

from tests.engine.checks.random_run_laws import energy_error
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import simulate

WAYS = (("auto", 1e-6), ("rk5", 1e-5), ("rk8", 1e-7))
MOST_STEPS = 200
"""Ten times the steps of the widest of these platforms."""
ENERGY = 3e-4
"""Allowed energy error relative to the energy converted. At the loosest of these tolerances, ten platforms have at most 2e-4; if
legs stopped for good, they would lose 2e-2."""


def bar(mass: float, size: tuple[float, float, float], at: np.ndarray, **points: np.ndarray) -> sm.Body:
    """A box at a place, with points given in the ground's axes."""
    x, y, z = (mass * s**2 / 12.0 for s in size)
    return sm.Body(mass=mass, inertia=(y + z, x + z, x + y), points={k: tuple(map(float, p - at)) for k, p in points.items()})


def platform(seed: int) -> sm.Scene:
    """A platform whose legs stand 120° apart and are tilted inward. Springs and frictions of the legs differ."""
    rng = np.random.default_rng(seed)
    foot, top, height = rng.uniform(0.4, 0.6), rng.uniform(0.2, 0.35), np.array([0.0, 0.0, rng.uniform(0.5, 0.8)])
    bodies, joints, ground, tips = {}, {}, {}, {}
    for i in range(3):
        out = np.array([np.cos(2 * np.pi * i / 3), np.sin(2 * np.pi * i / 3), 0.0])
        f, h = foot * out, top * out + height
        u, across = (h - f) / np.linalg.norm(h - f), (float(-out[1]), float(out[0]), 0.0)
        ground[f"f{i}"], tips[f"h{i}"] = tuple(map(float, f)), h
        middle = (f + h) / 2
        bodies[f"cylinder{i}"] = bar(2.0, (0.05, 0.05, 0.4), f + 0.2 * u, foot=f, guide=middle)
        bodies[f"rod{i}"] = bar(1.0, (0.03, 0.03, 0.4), h - 0.2 * u, tip=h, guide=middle)
        mu, spring = rng.uniform(0.02, 0.4, 3), sm.Spring(float(rng.uniform(8e3, 3e4)), float(rng.uniform(0.0, 0.02)))
        pin = sm.Friction(mu=float(mu[0]), radius=0.012, half_length=0.03)
        slide = sm.Friction(mu=float(mu[1]), half_length=0.05, half_width=0.015, half_height=0.015)
        ball = sm.Friction(mu=float(mu[2]), radius=0.015)
        joints[f"r{i}"] = sm.Joint("revolute", f"ground.f{i}", f"cylinder{i}.foot", axis=across, friction=pin)
        joints[f"p{i}"] = sm.Joint(
            "prismatic", f"cylinder{i}.guide", f"rod{i}.guide", axis=tuple(map(float, u)), reference=across, friction=slide,
            spring=spring, damping=float(rng.uniform(50.0, 400.0)), start=sm.Start(0.0, 0.0),
        )  # fmt: skip
        joints[f"s{i}"] = sm.Joint("spherical", f"rod{i}.tip", f"platform.h{i}", friction=ball)
    bodies["platform"] = bar(float(rng.uniform(10.0, 40.0)), (0.5, 0.5, 0.03), height, **tips)
    return sm.Scene(bodies, joints, f"platform{seed}", gravity=(0.0, 0.0, -9.81), ground=sm.Ground(points=ground))


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", [2, 3, 4])
def test_all_settings_find_the_same_events_on_a_nearly_stuck_platform(seed: int) -> None:
    lists = []
    for method, rtol in WAYS:
        r = simulate(platform(seed), until=0.05, every=0, method=method, rtol=rtol, outputs=("energy.*",), max_steps=MOST_STEPS)
        assert r.outcome.ok, r.outcome
        assert energy_error(r) <= ENERGY
        lists.append(sorted((e.kind, e.joint) for e in r.events if e.kind not in ("contact_jump", "separation")))
    assert lists[0] == lists[1] == lists[2]
