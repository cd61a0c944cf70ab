"""Random mechanisms with every device move alike in a turned world, in a mirror, and a thousand times as large."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.engine.checks.turned_mirrored_scaled_scenes import factor, image, scaled
from tests.reference.mechanics.rotation import random_rotation
from trunnion import Scene, scene_from_dict, simulate
from trunnion.simulation.results.result import Result

COMPARED = (".q[", ".qd[", "friction.torque", "friction.force", "end_stop.effort", "latch.effort", "kinetic", "dissipated")
LARGER = (1e3, 1.0, 1e3**0.5)
CLOSE = 1e-5
"""Allowed difference, relative to the largest value of a column. Runs at 1e-9 differ in their last steps before events."""
KINDS: dict[str, dict[str, Any]] = {
    "revolute": {"friction": {"mu": 0.2, "radius": 0.01, "half_length": 0.03}, "start": {"q": 0.1, "qd": 3.0},
                 "end_stops": {"stiffness": 200.0, "upper": 0.5, "lower": -0.4, "damping": 0.1},
                 "latch": {"at": 0.2, "stiffness": 100.0}},
    "prismatic": {"friction": {"mu": 0.15, "half_width": 0.02, "half_height": 0.01, "half_length": 0.3}, "start": {"qd": 0.8},
                  "spring": {"stiffness": 60.0, "rest": 0.02}, "end_stops": {"stiffness": 3e3, "upper": 0.08, "lower": -0.08}},
    "cylindrical": {"friction": {"mu": 0.1, "radius": 0.01, "half_length": 0.4}, "start": {"qd": [0.5, 2.0]},
                    "spring": [{"stiffness": 80.0}, None]},
    "spherical": {"friction": {"mu": 0.2, "radius": 0.02}, "start": {"qd": [1.0, -2.0, 2.0]}},
    "universal": {"friction": {"mu": 0.1, "radius": 0.01, "half_length": 0.1}, "start": {"qd": [1.0, -2.0]}},
    "planar": {"damping": [0.5, 0.5, 0.05], "start": {"qd": [0.3, -0.2, 1.0]},
               "spring": [{"stiffness": 100.0}, {"stiffness": 100.0}, None]},
    "screw": {"pitch": 0.05, "start": {"qd": 2.0}},
}  # fmt: skip


def tree(seed: int) -> Scene:
    """Two or three bodies in a row, with a bushing, a spring, and loads along axes of the world and of the body."""
    rng = np.random.default_rng(seed)

    def vector(size: float) -> list[float]:
        return [float(x) for x in rng.uniform(-size, size, 3)]

    bodies, joints, before = {}, {}, "ground"
    count = int(rng.integers(2, 4))
    for i in range(count):
        kind = str(rng.choice(sorted(KINDS)))
        joints[f"j{i}"] = {"type": kind, "inboard": before, "outboard": f"b{i}", "axis": vector(1.0), "reference": vector(1.0)}
        joints[f"j{i}"] |= KINDS[kind]
        bodies[f"b{i}"] = {"box": [0.1, 0.05, 0.08], "mass": float(rng.uniform(0.5, 2.0)), "center": vector(0.08),
                           "points": {"a": vector(0.15), "p": vector(0.1)}}  # fmt: skip
        before = f"b{i}.a"
    last = f"b{count - 1}"
    push = [{"harmonic": {"amplitude": 3.0, "frequency": 1.5}}, 1.0, -0.5]
    forces = {
        "bush": {"type": "bushing", "between": ["ground.o", f"{last}.p"], "axis": vector(1.0), "reference": vector(1.0),
                 "stiffness": [30.0, 60.0, 20.0], "damping": 0.3, "turning_stiffness": [0.2, 0.5, 0.3], "turning_damping": 0.01},
        "push": {"type": "force", "on": f"{last}.p", "frame": str(rng.choice(["world", "body"])), "force": push},
        "twist": {"type": "torque", "on": "b0", "torque": vector(0.3)},
        "rope": {"type": "spring_damper", "between": ["ground.o", f"{last}.a"], "stiffness": 40.0, "damping": 0.5, "length": 0.2},
    }  # fmt: skip
    return scene_from_dict({"schema": 1, "gravity": vector(6.0), "ground": {"points": {"o": vector(0.3)}}, "bodies": bodies,
                            "joints": joints, "forces": forces})  # fmt: skip


def followers(seed: int) -> Scene:
    """A cam that lifts a follower, and a body with a point that stays on a curve."""
    rng = np.random.default_rng(seed)
    angles = np.linspace(0.0, 2 * np.pi, 13)
    radii = 0.06 + 0.02 * np.sin(angles + rng.uniform(0.0, 6.0))
    heights = rng.uniform(-0.02, 0.04, 5) * (1, 1, 0, 1, 1)
    points = [[float(x), float(y)] for x, y in zip(np.linspace(-0.2, 0.2, 5), heights, strict=True)]
    at = {"body": "ground", "point": [0.5, 0.1, 0.0]}
    flat = {"axis": "z", "reference": "x"}
    lifts = {"spring": {"stiffness": 50.0, "rest": 0.03}, "friction": {"force": 0.3}, "start": {"q": 0.06}}
    joints: dict[str, dict[str, Any]] = {
        "shaft": {"type": "revolute", "inboard": "ground", "outboard": "c", "start": {"qd": float(rng.uniform(2.0, 6.0))}} | flat,
        "guide": {"type": "prismatic", "axis": "y", "reference": "z", "inboard": "ground", "outboard": "f"} | lifts,
        "cam": {"type": "cam", "inboard": "c", "outboard": "f", "profile": {"angle": list(angles), "radius": list(radii)}} | flat,
        "table": {"type": "planar", "inboard": at, "outboard": "b"} | flat,
        "slot": {"type": "point_on_curve", "inboard": at, "outboard": "b", "curve": {"points": points}} | flat,
    }
    joints["cam"]["profile"]["radius"][-1] = joints["cam"]["profile"]["radius"][0]
    bodies = {n: {"mass": 0.5, "inertia": [2e-3] * 3} for n in "cfb"}
    return scene_from_dict({"schema": 1, "gravity": [0, -5, 0], "bodies": bodies, "joints": joints})


def run(scene: Scene, time: float = 1.0) -> Result:
    return simulate(scene, until=0.4 * time, every=0.04 * time, rtol=1e-9, method="rk8")


def events(r: Result) -> list[tuple[str, str]]:
    """Kind and joint of each event."""
    return sorted((e.kind, e.joint) for e in r.events)


def check(scene: Scene, seed: int) -> None:
    """Compare the scene in its own world with the scene turned, mirrored and scaled. In a mirror, some travels and torques change
    their sign."""
    own = run(scene)
    assert own.outcome.ok, own.outcome
    Q, mirror = random_rotation(np.random.default_rng(seed)), np.diag([1.0, -1.0, 1.0])
    stiff = replace(scene, joints={n: replace(j, stiffness=j.stiffness or 1e8) for n, j in scene.joints.items()})
    worlds = [(image(scene, Q), (1.0, 1.0, 1.0)), (image(scene, Q @ mirror), (1.0, 1.0, 1.0)), (scaled(stiff, *LARGER), LARGER)]
    for other, units in worlds:
        r = run(other, units[2])
        assert r.outcome.ok, r.outcome
        assert events(r) == events(own)
        for c in own.columns:
            if any(word in c.name for word in COMPARED):
                x, y = np.abs(own[c.name]), np.abs(r[c.name]) / factor(c.unit, *units)
                assert y == pytest.approx(x, rel=0.0, abs=CLOSE * (1e-2 + x.max())), c.name


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", range(5))
def test_a_tree_moves_alike_in_other_worlds(seed: int) -> None:
    check(tree(seed), seed)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", range(2))
def test_followers_move_alike_in_other_worlds(seed: int) -> None:
    check(followers(seed), seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 200))
def test_many_mechanisms_move_alike_in_other_worlds(seed: int) -> None:
    check(tree(seed) if seed % 4 else followers(seed), seed)
