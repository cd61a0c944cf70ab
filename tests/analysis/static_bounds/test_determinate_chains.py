"""Statically determinate chains: bounds equal the only solution. Runs with loads just within the bounds do not move."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from trunnion import hold, scene_from_dict, simulate
from trunnion.scene.data_classes.scene import Scene

EDGE = 1e-6
FRICTION: dict[str, tuple[str, dict[str, float]]] = {
    "revolute": ("revolute", {"mu": 0.4, "radius": 0.02, "half_length": 0.1}),
    "thrust": ("revolute", {"mu": 0.4, "radius": 0.02, "half_length": 0.1, "thrust_radius": 0.02}),
    "preload": ("revolute", {"mu": 0.3, "radius": 0.02, "half_length": 0.1, "preload": 60.0}),
    "seal": ("revolute", {"torque": 1.5}),
    "freewheel": ("revolute", {"torque": 0.8, "back_torque": 6.0}),
    "cylindrical": ("cylindrical", {"mu": 0.5, "radius": 0.02, "half_length": 0.3}),
    "prismatic": ("prismatic", {"mu": 0.6, "half_width": 0.02, "half_height": 0.02, "half_length": 0.4}),
    "rail": ("prismatic", {"force": 50.0}),
    "spherical": ("spherical", {"mu": 0.5, "radius": 0.08}),
    "universal": ("universal", {"mu": 0.4, "radius": 0.02, "half_length": 0.1}),
    "screw": ("screw", {"mu": 0.3, "radius": 0.02, "flank_angle": 0.3}),
    "screw_preload": ("screw", {"mu": 0.2, "radius": 0.01, "flank_angle": 0.3, "preload": 15.0}),
}
"""Joint type and friction of each element."""


def chain(seed: int, first: str, gravity: float = -9.81) -> Scene:
    """One or two bodies that hang on joints in any direction; an input pushes the last body."""
    rng = np.random.default_rng(seed)
    bodies, joints, before = {}, {}, "ground"
    kinds = [first, *rng.choice(sorted(FRICTION), int(rng.integers(0, 2)))]

    def vector(size: float) -> list[float]:
        return [float(x) for x in rng.uniform(-size, size, 3)]

    for i, kind in enumerate(kinds):
        name, friction = FRICTION[kind]
        joint: dict[str, Any] = {"type": name, "inboard": before, "outboard": f"b{i}", "friction": friction}
        if name != "spherical":
            joint |= {"axis": vector(1.0), "reference": vector(1.0)}
        if name == "screw":
            joint["pitch"] = float(rng.uniform(0.002, 0.012))
        points = {"a": vector(0.02), "p": vector(0.02)}
        bodies[f"b{i}"] = {"mass": float(rng.uniform(0.3, 2.0)), "inertia": [0.02] * 3, "center": vector(0.004), "points": points}
        joints[f"j{i}"], before = joint, f"b{i}.a"
    force = {"type": "force", "on": f"b{len(kinds) - 1}.p", "force": [{"input": "u"}, 0, 0]}
    return scene_from_dict({"schema": 1, "gravity": [0, 0, gravity], "bodies": bodies, "joints": joints, "forces": {"f": force},
                            "inputs": {"u": {"start": 0, "unit": "N"}}})  # fmt: skip


def moves(scene: Scene, push: float) -> bool:
    """Whether the chain moves in a run that starts from rest under this push. A chain slightly beyond its limit may soon stop
    again."""
    r = simulate(scene, until=0.1, every=0.01, overrides={"inputs.u.start": push}, outputs="*.qd[*")
    assert r.outcome.ok
    return bool(np.abs(r.data[:, 1:]).max() > 0.0)


def check(seed: int, kind: str) -> bool:
    """Compare a chain with its bounds; returns whether it holds."""
    scene = chain(seed, kind)
    one, all_states = hold(scene), hold(scene, bounds=True, cells=60)
    assert all_states.open == 0
    assert all_states.holds == ("certain" if one.holds else "no"), (one.holds, all_states.holds)
    assert moves(scene, 0.0) != one.holds
    if not one.holds:
        return False
    exact = [(p, q) for p, q in zip(one.pairs, all_states.pairs, strict=True) if q.exact]
    for p, q in exact:
        assert [q.share.least.certified, q.share.largest.certified] == pytest.approx([p.share] * 2, rel=1e-6, abs=1e-9), p.joint
    load = all_states.load("inputs.u")
    for sense, found in ((1.0, load.more), (-1.0, load.less)):
        sure, most = found.guaranteed.certified, found.possible.certified
        assert sense * sure <= sense * most + 1e-9
        if math.isfinite(sure) and sense * sure > 1e-6:
            assert not moves(scene, sure * (1.0 - EDGE)), (sense, sure)
        if math.isfinite(most):
            assert moves(scene, most + sense * EDGE * max(abs(most), 1.0)), (sense, most)
    return True


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("kind", ["screw", "screw_preload", "prismatic"])
def test_bounds_of_a_chain_are_those_of_runs(kind: str) -> None:
    assert sum(check(seed, kind) for seed in range(2))


@pytest.mark.slow
@pytest.mark.parametrize("kind", FRICTION)
@pytest.mark.parametrize("seed", range(100, 127))
def test_bounds_of_many_chains_are_those_of_runs(seed: int, kind: str) -> None:
    check(seed, kind)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", [211, 3, 17, 24, 25, 27, 30, 34, 36, 213, 218])
def test_the_only_state_of_a_shaft_has_the_share_of_the_kernel(seed: int) -> None:
    """For a shaft, bounds of the capacity do not decide whether the chain holds."""
    scene = chain(seed, "cylindrical")
    one, found = hold(scene), hold(scene, bounds=True, cells=20)
    assert found.holds == "certain"
    for p, q in zip(one.pairs, found.pairs, strict=True):
        assert q.exact
        assert [q.share.least.certified, q.share.largest.certified] == pytest.approx([p.share] * 2, rel=1e-9), p.joint


def test_the_share_of_a_ball_is_closed_without_a_search() -> None:
    """The least and the largest share of the ball equal its only share, although the search has only two cells."""
    scene = chain(200, "spherical")
    (one,), (found,) = hold(scene).pairs, hold(scene, bounds=True, cells=2).pairs
    assert [found.share.least.certified, found.share.largest.certified] == pytest.approx([one.share] * 2, rel=1e-12)


def test_a_load_that_presses_a_pin_without_limit_has_no_largest_possible_amount() -> None:
    """A cone of the pin is nearly a half space. The bounds must contain this cone as a whole."""
    scene = chain(218, "revolute")
    assert not moves(scene, 29602.0)
    assert hold(scene, bounds=True, cells=20).load("inputs.u").more.possible.certified == math.inf


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("kind", ["cylindrical", "universal", "spherical", "screw"])
def test_a_chain_without_load_holds(kind: str) -> None:
    """The pairs carry no load and cannot resist any load."""
    scene = chain(3, kind, gravity=0.0)
    scene = replace(scene, joints={n: replace(j, friction=scene.joints["j0"].friction) for n, j in list(scene.joints.items())[:1]},
                    bodies={"b0": scene.bodies["b0"]}, forces={"f": replace(scene.forces["f"], on="b0.p")})  # fmt: skip
    found = hold(scene, bounds=True, cells=20)
    assert hold(scene).holds
    assert found.holds == "certain"
    assert any("nothing disturbs them" in n for n in found.notes)
    for p in found.pairs:
        assert (p.share.least.certified, p.share.largest.certified) == (0.0, 0.0)
    assert found.load("inputs.u").more.guaranteed.certified == 0.0
