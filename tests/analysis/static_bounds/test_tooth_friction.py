"""Bounds at rest of teeth with friction, compared with the only solution, with textbook efficiencies, and with limits from runs."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from tests.engine.mechanisms.gear_pairs import flying
from tests.engine.mechanisms.worm_gears import random_worm
from trunnion import SceneError, hold, scene_from_dict, simulate
from trunnion.analysis.static_bounds.equilibrium_equations import statics
from trunnion.analysis.static_bounds.equilibrium_space import _driving_row
from trunnion.scene.data_classes import scene as sm

EDGE = 1e-6
STILL = 1e-9
"""Rate, rad/s or m/s, below which wheels rest: round-off of the loop is 1e-12, an excess of EDGE gives 1e-7 and more."""
KINDS = ("gear", "internal", "bevel_gear", "rack", "worm")


@cache
def pair(kind: str, seed: int) -> sm.Scene:
    """Two wheels out of balance on the ground, with friction at their teeth. The input ``u`` acts on the inboard wheel, and a
    constant load on the outboard wheel."""
    rng = np.random.default_rng([5, seed])
    load = float(rng.normal()) * (30.0 if kind == "rack" else 3.0)
    if kind == "worm":
        one, two = "worm_shaft", "wheel_shaft"
        worm = random_worm(seed)
        scene = replace(worm, mu=max(worm.mu, 0.01)).scene({}, {})
    else:
        one, two = "on_w0", "on_w1"
        friction = sm.Friction(mu=float(rng.uniform(0.05, 0.4)), pressure_angle=float(rng.uniform(0.2, 0.5)))
        scene = flying(seed, (kind,), friction).scene
    joints = dict(scene.joints)
    if "fly" in joints:
        joints["fly"] = sm.Joint("fixed", joints["fly"].inboard, joints["fly"].outboard)
    joints[one] = replace(joints[one], start=None, effort=sm.FromInput("u"))
    joints[two] = replace(joints[two], effort=load)
    return replace(scene, joints=joints, inputs={"u": sm.Input(start=0.0, unit="N*m")})


def moves(scene: sm.Scene, effort: float) -> bool:
    """Whether the wheels move in a run that starts from rest under this effort of the inboard wheel."""
    r = simulate(scene, until=0.1, every=0.01, overrides={"inputs.u.start": effort}, outputs="*.qd[*")
    assert r.outcome.ok
    return bool(np.abs(r.data[:, 1:]).max() > STILL)


def check(kind: str, seed: int) -> None:
    """Compare bounds with the only solution, and with runs on both sides of the limits."""
    scene = pair(kind, seed)
    load = hold(scene, bounds=True).load("inputs.u")
    low, high = load.less.possible.certified, load.more.possible.certified
    assert low < high
    size = max(abs(low), abs(high))
    for inside, outside in ((high - EDGE * size, high + EDGE * size), (low + EDGE * size, low - EDGE * size)):
        assert hold(scene, {"inputs.u.start": inside}, bounds=True).holds == "certain"
        assert hold(scene, {"inputs.u.start": inside}).holds
        assert not moves(scene, inside)
        assert hold(scene, {"inputs.u.start": outside}, bounds=True).holds == "no"
        assert not hold(scene, {"inputs.u.start": outside}).holds
        assert moves(scene, outside)
    middle = 0.7 * low + 0.3 * high
    one, found = hold(scene, {"inputs.u.start": middle}), hold(scene, {"inputs.u.start": middle}, bounds=True)
    assert found.open == 0
    (p,), (q,) = one.pairs, found.pairs
    assert [q.share.least.certified, q.share.largest.certified] == pytest.approx([p.share] * 2, abs=1e-8)
    now = found.load("inputs.u")
    assert (now.less.guaranteed.certified, now.more.guaranteed.certified) == pytest.approx((low, high), rel=1e-7, abs=1e-7 * size)


@pytest.mark.parametrize("kind", KINDS)
def test_bounds_of_teeth_are_those_of_runs(kind: str) -> None:
    check(kind, 1)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(100, 125))
def test_bounds_of_many_teeth_are_those_of_runs(kind: str, seed: int) -> None:
    check(kind, seed)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("kind", KINDS)
def test_the_driving_force_of_teeth_is_one_multiplier_and_several_are_refused(kind: str) -> None:
    st = statics(pair(kind, 1))
    (joint,) = st.joints
    by = np.abs(st.reaction[joint.reactions, : st.eta0]).max(axis=0)
    assert by.max() > 0.0
    assert np.sort(by)[:-1] == pytest.approx(0.0, abs=1e-9 * by.max())
    twice = np.insert(st.reaction, 0, st.reaction[:, int(np.argmax(by))], axis=1)
    with pytest.raises(SceneError, match=rf"joints\.{joint.rubs.joint}: the reactions of its teeth depend on 2 multipliers"):
        _driving_row(replace(st, reaction=twice, multipliers=st.multipliers + 1), twice.shape[1], joint)


def train(seed: int) -> tuple[sm.Scene, float, float]:
    """(three or four wheels in a row, least and largest torque of the first wheel that holds the load of the last wheel).

    A mesh with radii r and s transmits its torque with a ratio from (r − κ)/(s + κ) to (r + κ)/(s − κ), κ = μ π m/4."""
    rng = np.random.default_rng([6, seed])
    module, mu, load = 0.004, float(rng.uniform(0.05, 0.2)), float(rng.uniform(1.0, 9.0))
    teeth = [int(z) for z in rng.integers(15, 60, int(rng.integers(3, 5)))]
    roll = mu * math.pi * module / 4
    bodies = {f"w{k}": {"mass": 1, "inertia": [0.01, 0.01, 0.02]} for k in range(len(teeth))}
    joints: dict[str, Any] = {}
    at, low, high = np.zeros(2), load, load
    for k, z in enumerate(teeth):
        side = {"body": "ground", "point": [*map(float, at), 0.0]}
        joints[f"on_{k}"] = {"type": "revolute", "axis": "z", "inboard": side, "outboard": f"w{k}"}
        if k + 1 == len(teeth):
            break
        friction = {"mu": mu, "pressure_angle": "20 deg"}
        joints[f"m{k}"] = {"type": "gear", "axis": "z", "inboard": f"w{k}", "outboard": f"w{k + 1}", "teeth": [z, teeth[k + 1]],
                           "module": module, "friction": friction}  # fmt: skip
        r, s = module * z / 2, module * teeth[k + 1] / 2
        low, high = low * (r - roll) / (s + roll), high * (r + roll) / (s - roll)
        way = rng.uniform(-1.0, 1.0)
        at = at + (r + s) * np.array([math.cos(way), math.sin(way)])
    opposite = len(teeth) % 2 == 0  # the wheels of each mesh turn in opposite directions
    joints["on_0"]["effort"] = {"input": "u"}
    joints[f"on_{len(teeth) - 1}"]["effort"] = load if opposite else -load
    inputs = {"u": {"start": 0.5 * (low + high), "unit": "N*m"}}
    return scene_from_dict({"gravity": [0, 0, 0], "bodies": bodies, "joints": joints, "inputs": inputs}), low, high


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", range(100))
def test_a_train_holds_between_the_products_of_its_efficiencies(seed: int) -> None:
    scene, low, high = train(seed)
    found = hold(scene, bounds=True)
    load = found.load("inputs.u")
    assert found.holds == "certain"
    assert found.open == len(found.pairs) - 1
    for name in ("possible", "guaranteed"):
        ends = getattr(load.less, name).certified, getattr(load.more, name).certified
        assert ends == pytest.approx((low, high), rel=1e-7), name


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("kind", KINDS[:3] + KINDS[4:])
@pytest.mark.slow
def test_teeth_load_their_bearings_in_bounds_as_in_runs(kind: str, seed: int) -> None:
    """Friction in the two bearings depends on the force that pushes the wheels apart. Only the sum of all frictions is
    determined."""
    scene = pair(kind, seed)
    joints = dict(scene.joints)
    for name in [n for n, j in joints.items() if j.type == "revolute"]:
        joints[name] = replace(joints[name], friction=sm.Friction(mu=0.15, radius=0.008, half_length=0.03))
    scene = replace(scene, joints=joints)
    load = hold(scene, bounds=True).load("inputs.u")
    low, high = load.less.possible.certified, load.more.possible.certified
    middle, size = {"inputs.u.start": 0.5 * (low + high)}, max(abs(low), abs(high))
    one, found = hold(scene, middle), hold(scene, middle, bounds=True)
    assert (one.holds, found.holds, found.open) == (True, "certain", 2)
    for p, q in zip(one.pairs, found.pairs, strict=True):
        assert q.share.contains(p.share, 1e-6), p.joint
    for sense in (-1.0, 1.0):
        now = found.load("inputs.u")
        sure = (now.more if sense > 0 else now.less).guaranteed.certified
        assert not moves(scene, sure - sense * EDGE * size)
        assert moves(scene, (high if sense > 0 else low) + sense * EDGE * size)
