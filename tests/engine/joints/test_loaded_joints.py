"""Friction of robot joints grows with the transmitted load. Constants depend on the sense of motion, coefficients on the direction
of power."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import trunnion
from tests.engine.mechanisms.robot_hinge import Hinge, random_hinge
from tests.engine.parts.test_compiled_kernel_equivalence import agree
from tests.reference.scenes.random_scenes import random_tree
from trunnion import SceneError, hold, scene_from_dict, sensitivity, simulate
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.scene_loader import scene_from_text

PLACE = "hinge.q[1]"
ROBOT = Hinge(1.2, 0.4, 9.0, -5.0, 0.8, 0.6, 0.15, 0.25, 0.0)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", range(120))
def test_a_loaded_joint_moves_reverses_and_rests_as_the_closed_form(seed: int) -> None:
    """Hinges and guides, with and without rotor, with the pin on either part. The friction shares at rest and the bounds are also
    exact."""
    h = random_hinge(seed)
    r = simulate(h.scene(), rtol=1e-10, outputs=[PLACE], kernel="compiled" if seed % 40 == 5 else "parts")
    assert r.outcome.name == "done"
    assert r[PLACE] == pytest.approx(h.places(r.time), abs=1e-9)
    found = hold(replace(h, rate=0.0).scene(), bounds=True)
    assert found.answer.pairs[0].share == pytest.approx(h.share, rel=1e-9)
    assert found.holds == ("certain" if h.share < 1 else "no")
    if h.share < 1:
        assert found.pairs[0].share.largest.value == pytest.approx(h.share, rel=1e-8)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", range(8))
def test_both_kernels_write_the_same_with_loaded_joints(seed: int) -> None:
    scene = random_tree(f"loaded{seed}", 5, friction=0.0).scene
    joints = {}
    for n, j in scene.joints.items():
        key = {"revolute": "torque", "prismatic": "force"}.get(j.type)
        rubs = sm.Friction(**{key: 0.3}, load_friction=0.1, load_friction_backward=0.2) if key else None
        joints[n] = replace(j, friction=rubs)
    agree(replace(scene, joints=joints))


def test_derivatives_of_a_run_by_the_numbers_of_loaded_friction_are_those_of_the_closed_form() -> None:
    for h, keys in ((ROBOT, {"torque": "constant", "load_friction": "driving"}),
                    (replace(ROBOT, motor=1.0), {"back_torque": "constant_back", "load_friction_backward": "driven"})):  # fmt: skip
        found = sensitivity(h.scene(), tuple(f"joints.hinge.friction.{k}" for k in keys), (PLACE,), rtol=1e-10)
        for key, name in keys.items():
            up, down = (replace(h, **{name: getattr(h, name) + x}).places(found.time) for x in (1e-6, -1e-6))
            assert found.d(PLACE, f"joints.hinge.friction.{key}")[1:] == pytest.approx((up - down)[1:] / 2e-6, rel=1e-6), key


def test_a_driven_joint_needs_the_torque_of_its_arm_and_of_the_friction_that_this_torque_causes() -> None:
    joint = {"type": "revolute", "axis": "y", "inboard": "ground", "outboard": "arm", "drive": {"constant": {"rate": 1.0}},
             "friction": {"torque": 2.0, "load_friction": 0.1, "load_friction_backward": 0.2}}  # fmt: skip
    arm = {"mass": 10, "center": [0.4, 0, 0], "inertia": [1, 1, 1]}
    scene = scene_from_dict({"gravity": [0, 0, -9.81], "bodies": {"arm": arm}, "joints": {"elbow": joint}})
    r = simulate(scene, until=6.0, every=0.1)
    torque = -10 * 9.81 * 0.4 * np.cos(r.time)  # the weight first acts in the sense of the motion (+y): the arm drives the joint
    rubs = 2.0 + np.where(torque > 0, 0.1, 0.2) * np.abs(torque)
    assert r["elbow.drive.effort[1]"] == pytest.approx(torque + rubs, rel=1e-9)


def test_the_elbow_of_the_guide_agrees_with_hand_calculation() -> None:
    page = (Path(trunnion.__file__).parent / "docs/guide/friction.md").read_text(encoding="utf-8")
    (text,) = (block.split("```")[0] for block in page.split("```yaml\n")[1:] if "name: elbow" in block.split("```")[0])
    scene = scene_from_text(text)
    for rate, torque in ((1.0, 39.24 * 1.1 + 2), (-1.0, 39.24 * 0.8 - 2)):
        r = simulate(scene, until=0.1, overrides={"joints.elbow.drive.constant.rate": rate})
        assert r["elbow.drive.effort[1]"][0] == pytest.approx(torque, rel=1e-12)


WRONG = {
    "load_friction must lie between 0 and 0.99 (it is 1.2)": ("revolute", {"torque": 1, "load_friction": 1.2}),
    "load_friction_backward must lie between 0 and 0.99": (
        "revolute", {"torque": 1, "load_friction": 0.1, "load_friction_backward": 1}),
    "needs torque and load_friction: torque is missing": ("revolute", {"load_friction": 0.1}),
    "needs force and load_friction: load_friction is missing": ("prismatic", {"force": 1, "load_friction_backward": 0.1}),
    "has no radius (allowed here: torque, back_torque, load_friction": (
        "revolute", {"torque": 1, "load_friction": 0.1, "radius": 1}),
    "a cylindrical joint has no friction that depends on the transmitted load": ("cylindrical", {"load_friction": 0.1}),
}  # fmt: skip


@pytest.mark.parametrize("says", WRONG)
def test_impossible_loaded_friction_is_refused_with_the_reason(says: str) -> None:
    kind, friction = WRONG[says]
    joint = {"type": kind, "axis": "x", "inboard": "ground", "outboard": "arm", "friction": friction}
    with pytest.raises(SceneError, match=re.escape(says)):
        scene_from_dict({"bodies": {"arm": {"mass": 1, "inertia": [1, 1, 1]}}, "joints": {"hinge": joint}})
