"""A joint that follows another joint keeps its ratio by a pair of efforts along both freedoms."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from trunnion import sensitivity
from trunnion.basics.errors import SceneError
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.data_classes.joint_couplings import Mimic
from trunnion.scene.scene_loader import scene_from_text
from trunnion.simulation.run import simulate
from trunnion.system.construction.system_builder import build

KINDS = ("revolute", "prismatic", "screw")
WAYS = [(ties, rubs, seed) for ties in (1, 3) for rubs in (0, 2, 9) for seed in (0, 1)]

RUNS = [*((*w, "parts") for w in WAYS), (3, 0, 0, "compiled"), (3, 2, 0, "compiled")]


def scene(ties: int, rubs: int, seed: int) -> sm.Scene:
    """A random tree of nine bodies, each on a joint of one freedom. The first ``rubs`` joints have friction; ``ties`` joints follow
    other joints."""
    rng = np.random.default_rng([8, seed, ties, rubs])
    bodies, joints = {}, {}
    names = [f"b{k}" for k in range(9)]
    for k, name in enumerate(names):
        shape = rng.normal(size=(3, 3))
        J = 0.01 * (shape @ shape.T + np.eye(3))
        J = np.trace(J) * np.eye(3) - J
        six = tuple(float(J[i, m]) for i, m in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
        bodies[name] = sm.Body(mass=float(rng.uniform(0.5, 2)), center=tuple(map(float, 0.1 * rng.normal(size=3))), inertia=six)
        on = "ground" if k == 0 else names[int(rng.integers(0, k))]
        kind = "revolute" if k < rubs else KINDS[int(rng.integers(0, 3))]
        side = sm.Side(on, point=tuple(map(float, 0.2 * rng.normal(size=3))))
        joints[f"j{k}"] = sm.Joint(
            kind, side, sm.Side(name), axis=tuple(map(float, rng.normal(size=3))), pitch=0.1 if kind == "screw" else None,
            friction=sm.Friction(mu=0.1, radius=0.01, half_length=0.05) if k < rubs else None,
            start=sm.Start(q=float(0.3 * rng.normal()), qd=float(rng.normal())),
        )  # fmt: skip
    order = rng.permutation(9)
    for k in range(ties):
        leader, follower = (f"j{order[2 * k + i]}" for i in (0, 1))
        tie = Mimic(leader, float(rng.normal()), float(0.2 * rng.normal()))
        joints[follower] = replace(joints[follower], mimic=tie, start=None)
    return sm.Scene(bodies=bodies, joints=joints, gravity=(0.5, -2, -9), simulation=sm.Simulation(until=0.1, every=0.05))


@pytest.mark.default_cases(2)
@pytest.mark.parametrize(("ties", "rubs", "seed", "kernel"), RUNS)
def test_a_mimic_joint_moves_as_by_two_efforts_whose_works_cancel(ties: int, rubs: int, seed: int, kernel: str) -> None:
    tied = scene(ties, rubs, seed)
    r = simulate(tied, rtol=1e-10, kernel=kernel)
    assert r.outcome.name == "done"
    for i in range(len(r)):
        efforts = dict.fromkeys(tied.joints, 0.0)
        for name, j in tied.joints.items():
            if j.mimic:
                led = j.mimic.ratio * r[f"{j.mimic.joint}.q[1]"][i] + j.mimic.offset
                assert r[f"{name}.q[1]"][i] == pytest.approx(led, abs=1e-12)
                assert r[f"{name}.qd[1]"][i] == pytest.approx(j.mimic.ratio * r[f"{j.mimic.joint}.qd[1]"][i], rel=1e-12, abs=1e-12)
                efforts[name] += r[f"{name}.mimic.effort[1]"][i]
                efforts[j.mimic.joint] -= j.mimic.ratio * r[f"{name}.mimic.effort[1]"][i]
        free = {
            name: replace(j, mimic=None, effort=float(efforts[name]),
                          start=sm.Start(q=float(r[f"{name}.q[1]"][i]), qd=float(r[f"{name}.qd[1]"][i])))
            for name, j in tied.joints.items()
        }  # fmt: skip
        alone = simulate(replace(tied, joints=free), until=1e-6, every=1e-6)
        for name in tied.joints:
            assert alone[f"{name}.qdd[1]"][0] == pytest.approx(r[f"{name}.qdd[1]"][i], rel=1e-8, abs=1e-8), name
            for k in (2, 3):  # along e1 a joint also transmits its own effort, but not the effort of its tie to another joint
                column = f"{name}.reaction.force[{k}]"
                assert alone[column][0] == pytest.approx(r[column][i], rel=1e-8, abs=1e-7), column
    assert np.abs(r["energy.residual"]).max() < 1e-8 * max(1.0, r["energy.kinetic"].max())


GRIPPER = """\
schema: 1
gravity: [0, 0, 0]
bodies:
  a: {mass: 0.1, inertia: [1e-5, 1e-4, 1e-4], center: [30 mm, 0, 0], points: {tip: [60 mm, 0, 0]}}
  b: {mass: 0.1, inertia: [1e-5, 1e-4, 1e-4], center: [30 mm, 0, 0]}
  rod: {mass: 0.2, inertia: [1e-5, 1e-4, 1e-4]}
joints:
  near: {type: revolute, axis: z, inboard: ground, outboard: a, DRIVE}
  far: {type: revolute, axis: z, inboard: a.tip, outboard: b, mimic: {joint: near, ratio: 0.7, offset: 10 deg}}
  slide: {type: prismatic, axis: x, inboard: ground, outboard: rod, damping: 5, mimic: {joint: far, ratio: "20 mm/rad"}}
simulation: {until: 1 s, every: 0.1 s}
"""


def test_a_chain_of_mimic_joints_takes_all_its_power_from_its_drive() -> None:
    even = GRIPPER.replace("DRIVE", "drive: {constant: {rate: 2}}").replace("center: [30 mm, 0, 0]}", "center: [0, 0, 0]}")
    r = simulate(scene_from_text(even), rtol=1e-10)
    assert r["far.q[1]"] == pytest.approx(0.7 * 2 * r.time + np.radians(10), rel=1e-12)
    assert r["slide.q[1]"] == pytest.approx(0.02 * (1.4 * r.time + np.radians(10)), rel=1e-12)
    # the second part turns about its mass centre, so all rates are constant: only the damper takes power
    assert r["near.drive.power[1]"] == pytest.approx(5 * (0.02 * 1.4) ** 2, rel=1e-9)
    assert r["slide.mimic.effort[1]"] == pytest.approx(5 * 0.02 * 1.4, rel=1e-9)


def test_derivatives_by_ratio_and_offset_are_those_by_differences() -> None:
    text = GRIPPER.replace("DRIVE", "effort: 0.01, start: {q: 0.1}").replace("[0, 0, 0]", "[0, -9.81, 0]", 1)
    values = {"joints.far.mimic.ratio": 0.7, "joints.far.mimic.offset": float(np.radians(10)), "bodies.b.mass": 0.1}
    columns = ("near.qd[1]", "far.mimic.effort[1]", "rod.velocity[1]")
    free = scene_from_text(text)
    found = sensitivity(free, tuple(values), columns, until=0.3, every=0.1, rtol=1e-10)
    h = 1e-5
    for path, value in values.items():
        up, down = (simulate(free, until=0.3, every=0.1, rtol=1e-11, overrides={path: value + s * h}) for s in (1, -1))
        for column in columns:
            slope = (up[column] - down[column]) / (2 * h)
            assert found.d(column, path)[1:] == pytest.approx(slope[1:], rel=1e-6, abs=1e-7), (column, path)


FAR = "mimic: {joint: near, ratio: 0.7, offset: 10 deg}"
WRONG = {
    "there is no joint nearr": FAR.replace("near", "nearr"),
    "is a length; an angle is expected": FAR.replace("10 deg", "10 mm"),
    "a drive already prescribes the motion of this joint": FAR + ", drive: {constant: {rate: 1}}",
    "these joints follow each other in a circle": FAR.replace("near", "slide").replace("0.7", "5 rad/m"),
}


@pytest.mark.parametrize("says", WRONG)
def test_joints_that_cannot_follow_are_refused_with_the_reason(says: str) -> None:
    with pytest.raises(SceneError, match=re.escape(says)):
        build(scene_from_text(GRIPPER.replace("DRIVE", "damping: 0").replace(FAR, WRONG[says])))


@pytest.mark.parametrize("mu", [0.0, 0.2])
def test_many_fingers_move_each_as_one_alone(mu: float) -> None:
    def hand(count: int) -> sm.Scene:
        rubs = f"friction: {{mu: {mu}, radius: 4 mm, half_length: 10 mm}}" if mu else "damping: 0"
        bodies, joints, hinge = "", "", "type: revolute, axis: z"
        for k in range(count):
            shape = "inertia: [1e-5, 1e-4, 1e-4], center: [30 mm, 0, 0]"
            bodies += f"  a{k}: {{mass: {0.1 + 0.01 * k}, {shape}, points: {{tip: [60 mm, 0, 0]}}}}\n"
            bodies += f"  b{k}: {{mass: 0.1, {shape}}}\n"
            joints += f"  near{k}: {{{hinge}, inboard: ground, outboard: a{k}, {rubs}}}\n"
            joints += f"  far{k}: {{{hinge}, inboard: a{k}.tip, outboard: b{k}, mimic: {{joint: near{k}, ratio: 0.7}}, {rubs}}}\n"
        run = "simulation: {until: 0.2 s, every: 0.05 s}"
        return scene_from_text(f"schema: 1\ngravity: [0, -9.81, 0]\nbodies:\n{bodies}joints:\n{joints}{run}\n")

    many, one = (simulate(hand(n), rtol=1e-11) for n in (20, 1))
    for column in ("near0.q[1]", "far0.q[1]", "far0.mimic.effort[1]", "near0.reaction.force[2]"):
        assert many[column] == pytest.approx(one[column], rel=1e-8, abs=1e-9), column
