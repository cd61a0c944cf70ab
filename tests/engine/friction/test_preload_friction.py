"""Friction that does not depend on the load: given friction of a joint holds and brakes the joint under any load."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.reference.scenes.random_scenes import random_tree
from trunnion import hold
from trunnion.elements.contact.registry import REGISTRY as CONTACTS
from trunnion.elements.joints import REGISTRY
from trunnion.scene.checks import problems
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate

KERNELS = ("parts", "compiled")
EDGE, GRAVITY, MASS, SLOPE = 1e-9, 9.81, 2.0, 0.3
LENGTH = 1.0


def bar(torque: float, **rub: float) -> sm.Scene:
    """A horizontal bar on a hinge with given friction. Its weight exerts the torque m g L/2."""
    body = sm.Body(box=(LENGTH, 0.05, 0.05), mass=MASS, center=(LENGTH / 2, 0.0, 0.0))
    hinge = sm.Joint("revolute", "ground", "bar", axis="y", friction=sm.Friction(torque=torque, **rub), start=sm.Start(q=0.0))
    return sm.Scene({"bar": body}, {"joint": hinge}, "bar")


def block(joint: str, rub: sm.Friction) -> sm.Scene:
    """A block on a slope."""
    down = (float(np.cos(SLOPE)), 0.0, -float(np.sin(SLOPE)))
    slope = sm.Side("ground", axis=down, reference="y")
    guide = sm.Joint(joint, slope, "block", axis="x", reference="y", ends="outboard", friction=rub)
    return sm.Scene({"block": sm.Body(box=(0.1, 0.1, 0.1), mass=MASS)}, {"joint": guide}, "block", gravity=(0.0, 0.0, -GRAVITY))


def seal(joint: str, preload: float, mu: float) -> sm.Scene:
    """The block on a guide with a seal that presses on all sides."""
    size = {"half_width": 0.02, "half_height": 0.02} if joint == "prismatic" else {"radius": 0.02}
    return block(joint, sm.Friction(mu=mu, half_length=0.05, preload=preload, **size))


def moved(r: Result) -> float:
    assert r.outcome.ok
    return float(abs(r["joint.q[1]"][-1]))


WEIGHT = MASS * GRAVITY
MU = 0.2
PRESS = WEIGHT * (np.sin(SLOPE) / MU - np.cos(SLOPE))
"""Preload with which the seal of a guide just holds the block."""
JUST = {
    "bar": (bar, WEIGHT * LENGTH / 2),
    "block": (lambda force: block("prismatic", sm.Friction(force=force)), WEIGHT * np.sin(SLOPE)),
    "sleeve with a seal": (lambda press: seal("prismatic", press, MU), PRESS),
    "shaft with a seal": (lambda press: seal("cylindrical", press, MU), PRESS),
    "cylinder": (lambda force: block("cylindrical", sm.Friction(force=force, torque=0.0)), WEIGHT * np.sin(SLOPE)),
}
"""Scenes that depend on one number, and its value at the limit of rest by statics."""


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("which", JUST)
def test_preload_friction_holds_up_to_its_limit_and_not_beyond(which: str, kernel: str) -> None:
    make, edge = JUST[which]
    assert moved(simulate(make(edge * (1 + EDGE)), until=1.0, kernel=kernel)) == 0.0
    assert moved(simulate(make(edge * (1 - 1e-6)), until=1.0, kernel=kernel)) > 0.0


@pytest.mark.parametrize("which", JUST)
def test_preload_friction_holds_for_a_thousand_seconds(which: str) -> None:
    make, edge = JUST[which]
    assert moved(simulate(make(edge * 1.01), until=1000.0, every=100.0)) == 0.0


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("joint", ["prismatic", "cylindrical"])
def test_a_seal_adds_its_preload_to_the_loads(joint: str, kernel: str) -> None:
    """The acceleration is a = g sin α − μ (g cos α + P/m). The seal does not change the reported normal forces."""
    preload, mu = 5.0, 0.1
    r = simulate(seal(joint, preload, mu), until=1.0, kernel=kernel)
    rate = GRAVITY * np.sin(SLOPE) - mu * (GRAVITY * np.cos(SLOPE) + preload / MASS)
    assert r["joint.qdd[1]"][1:] == pytest.approx(np.full(len(r) - 1, rate), rel=1e-9)
    bare = simulate(seal(joint, 0.0, mu), until=1.0, kernel=kernel)
    names = r.matching("joint.contact[*].normal_force")
    assert [r[n][1] for n in names] == pytest.approx([bare[n][1] for n in names], rel=1e-9)


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_bar_with_given_friction_swings_by_its_closed_form(kernel: str) -> None:
    """The energy of one swing gives its end, m g L/2 sin q = T q. A static friction of 1.5 T then holds the bar or does not hold
    it."""
    torque = 3.0
    r = simulate(bar(torque), until=3.0, kernel=kernel)
    first = next(e for e in r.events if e.kind in ("reversal", "stick"))
    at = brentq(lambda q: WEIGHT * LENGTH / 2 * np.sin(q) - torque * q, 1.0, 3.0)
    row = int(np.searchsorted(r.time, first.time))
    near = simulate(bar(torque), until=first.time, kernel=kernel)
    assert near["joint.q[1]"][-1] == pytest.approx(at, abs=1e-6)  # near the reversal the angle changes little
    assert abs(r["joint.friction.torque[1]"][:row]) == pytest.approx(np.full(row, torque), rel=1e-12)
    assert "joint.contact[1].normal_force" not in r.names


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("law", ["coulomb", "stribeck", "regularized", "viscous", "lugre"])
def test_every_law_drags_in_proportion_to_what_is_given(law: str) -> None:
    extra = {"stribeck": {"mu_static": 1.5, "v_stribeck": 0.1}, "viscous": {"viscosity": 0.3}, "lugre": {"bristle_stiffness": 50.0}}
    r = simulate(bar(2.0, law=law, **extra.get(law, {})), until=0.5)
    assert r.outcome.ok
    rate = r["joint.qd[1]"]
    drag = {"coulomb": 1.0, "regularized": 1.0, "stribeck": 1 + 0.5 * np.exp(-((rate / 0.1) ** 2)), "viscous": 0.3 * rate}
    if law in drag:
        assert r["joint.friction.torque[1]"][5:] == pytest.approx((2.0 * drag[law] * np.ones(len(r)))[5:], rel=1e-9)
    assert abs(r["energy.residual"]).max() < 1e-4 * WEIGHT * LENGTH


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", range(4))
def test_constant_friction_acts_in_random_trees_as_efforts_of_its_size(seed: int) -> None:
    """While no joint reverses, given friction equals an effort of the same size against the motion."""
    types = ("revolute", "prismatic", "cylindrical", "universal", "screw")
    case = random_tree(f"given{seed}", types=types, friction=0.0, loads=False, devices=0.0, drives=0.0)
    rng = np.random.default_rng(seed)
    given, pushed = {}, {}
    for name, j in case.scene.joints.items():
        turns = {"prismatic": "F", "cylindrical": "FT", "universal": "TT"}.get(j.type, "T")
        sizes = [float(x) for x in rng.uniform(0.1, 0.5, len(turns))]
        torque = tuple(s for s, t in zip(sizes, turns, strict=True) if t == "T")
        said = {"force": sizes[0]} if "F" in turns else {}
        said |= {"torque": torque if len(torque) > 1 else torque[0]} if torque else {}
        against = tuple(-s * float(np.sign(v)) for s, v in zip(sizes, case.qd[name], strict=True))
        start = sm.Start(tuple(map(float, case.q[name])) if len(case.q[name]) > 1 else float(case.q[name][0]),
                         tuple(map(float, case.qd[name])) if len(turns) > 1 else float(case.qd[name][0]))  # fmt: skip
        given[name] = replace(j, friction=sm.Friction(**said), start=start)
        pushed[name] = replace(j, effort=against if len(against) > 1 else against[0], start=start)
    run = partial(simulate, until=1e-3, every=1e-4, kernel="parts")
    a, b = (run(replace(case.scene, joints=joints)) for joints in (given, pushed))
    assert not a.events
    for n in (n for n in b.names if ".qdd[" in n or n.endswith(("position[1]", "orientation[2]"))):
        assert a[n] == pytest.approx(b[n], rel=1e-7, abs=1e-7 * np.abs(b[n]).max())


def test_hold_includes_the_friction_of_a_preload() -> None:
    make, edge = JUST["bar"]
    assert hold(make(edge * 1.1)).holds
    assert not hold(make(edge * 0.9)).holds
    assert hold(seal("prismatic", PRESS * 1.1, MU), bounds=True).holds


@pytest.mark.parametrize("kind", [k.name for k in REGISTRY.values() if k.friction])
def test_every_joint_with_friction_has_a_preload_or_an_error_names_the_types_that_have(kind: str) -> None:
    able = {k.name for k in REGISTRY.values() if k.friction and "preload" in {s.name for s in CONTACTS[k.friction].sizes}}
    assert able >= {"revolute", "cylindrical", "prismatic", "universal", "screw"}
    joint = sm.Joint(kind, "ground", "b", friction=sm.Friction(mu=0.1, preload=5.0))
    scene = sm.Scene({"b": sm.Body(sphere=0.1, mass=1.0)}, {"j": joint}, "b")
    said = [p for p in problems(scene) if p.where.endswith("friction.preload")]
    assert bool(said) == (kind not in able)
    for p in said:
        assert p.what == f"friction of a {kind} joint has no preload"
        assert all(n in p.hint for n in able)


def test_contradictory_friction_keys_are_reported() -> None:
    both = block("prismatic", sm.Friction(force=1.0, mu=0.1, half_length=0.1))
    [found] = problems(both)
    assert "constant friction of a prismatic joint has no half_length" in found.what
    assert "preload" in found.hint
    ball = sm.Joint("spherical", "ground", "b", friction=sm.Friction(torque=1.0))
    [found] = problems(sm.Scene({"b": sm.Body(sphere=0.1, mass=1.0)}, {"j": ball}, "b"))
    assert "has no constant friction" in found.what
