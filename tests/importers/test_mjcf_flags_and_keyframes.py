"""MJCF: flags switch features off, keyframes give coordinates and rates, and aligned free joints refer to the mass centre."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.importers.test_mjcf import column, read
from trunnion.basics.errors import SceneError
from trunnion.importers import scene_of_mjcf

ACTING = 'damping="0.2" frictionloss="0.1" stiffness="2" springref="0.4" range="-3 3"'
ARM = f'<joint name="h" axis="0 1 0" {ACTING}/><inertial pos="0 0 -0.5" mass="1" diaginertia="0.01 0.01 0.01"/>'
FLAGS = {
    "": 2 * 0.4 - 0.2 - 0.1,
    'spring="disable"': -0.2 - 0.1,
    'damper="disable"': 2 * 0.4 - 0.1,
    'spring="disable" damper="disable"': -0.1,
    'passive="disable"': -0.1,
    'frictionloss="disable"': 2 * 0.4 - 0.2,
    'constraint="disable"': 2 * 0.4 - 0.2,
    'spring="enable" contact="disable"': 2 * 0.4 - 0.2 - 0.1,
}
"""Torque on the arm at 1 rad/s by flags, N m."""


@pytest.mark.parametrize("flags", FLAGS)
def test_a_force_that_a_flag_disables_does_not_act(flags: str, tmp_path: Path) -> None:
    text = f'<compiler angle="radian"/><option><flag {flags}/></option><worldbody><body name="arm">{ARM}</body></worldbody>'
    scene, _ = read(tmp_path, text + '<keyframe><key qvel="1"/></keyframe>')
    assert column(scene, "h.qd[1]", "h.qdd[1]") == pytest.approx([1, FLAGS[flags] / 0.26], rel=1e-12)


@pytest.mark.parametrize("flag", ["limit", "constraint", ""])
def test_disabled_limits_give_no_end_stops(flag: str, tmp_path: Path) -> None:
    file = tmp_path / "arm.xml"
    option = f'<option><flag {flag}="disable"/></option>' if flag else ""
    file.write_text(f'<mujoco>{option}<worldbody><body name="arm">{ARM}</body></worldbody></mujoco>')
    scene, _ = scene_of_mjcf(file, stops=1e4)
    assert (scene.joints["h"].end_stops is None) == bool(flag)


def test_a_disabled_equality_couples_nothing(tmp_path: Path) -> None:
    two = f'<body name="arm">{ARM}</body><body name="b"><joint name="g"/><geom size="0.1" mass="1"/></body>'
    tied = '<equality><joint joint1="g" joint2="h"/></equality>'
    scene, notes = read(tmp_path, f'<option><flag equality="disable"/></option><worldbody>{two}</worldbody>{tied}')
    assert scene.joints["g"].mimic is None
    assert any("not active" in n for n in notes)


@pytest.mark.parametrize(("joint", "gear", "torque"), [("0.1 0.2", None, 2.1), ("0", 2, 4 * 2.1), ("0.3 0.1", -2, 1.8 + 4 * 2.1)])
def test_quadratic_damping_grows_with_the_square_of_the_rate(joint: str, gear: float | None, torque: float, tmp_path: Path) -> None:
    """The damping torque is 0.1 v + 0.2 v² at 3 rad/s. An actuator's damping is multiplied by the square of its gear ratio (MuJoCo
    4.0.0)."""
    motor = f'<actuator><motor joint="a" gear="{gear}" armature="0.02" damping="0.1 0.2"/></actuator>' if gear else ""
    body = f'<body name="b"><joint name="a" axis="0 1 0" damping="{joint}"/>{ARM[ARM.index("<inertial") :]}</body>'
    for rate in (3, -3):
        scene, _ = read(tmp_path, f'<worldbody>{body}</worldbody>{motor}<keyframe><key qvel="{rate}"/></keyframe>')
        inertia = 0.26 + (gear**2 * 0.02 if gear else 0.0)
        assert column(scene, "a.qdd[1]") == pytest.approx([-np.sign(rate) * torque / inertia], rel=1e-12)


def test_the_coordinates_of_an_aligned_joint_are_those_of_the_mass_centre(tmp_path: Path) -> None:
    """The body turns by 2 rad/s about its first principal axis, which the keyframe places along the world's y."""
    inertial = '<inertial pos="0.1 0 -0.5" quat="0.9 0.1 0.2 0.3" mass="1" diaginertia="0.02 0.03 0.011"/>'
    half = np.sqrt(0.5)
    key = f'<keyframe><key qpos="1 2 3 {half} 0 0 {half}" qvel="4 5 6 2 0 0"/></keyframe>'
    scene, _ = read(tmp_path, f'<worldbody><body name="b"><freejoint align="true"/>{inertial}</body></worldbody>{key}')
    wanted = [f"b.{what}[{k}]" for what in ("position", "velocity", "angular_velocity") for k in (1, 2, 3)]
    assert column(scene, *wanted) == pytest.approx([1, 2, 3, 4, 5, 6, 0, 2, 0], abs=1e-14)


def test_principal_axes_that_mujoco_chooses_cannot_be_placed_by_a_keyframe(tmp_path: Path) -> None:
    body = '<body name="b"><freejoint align="true"/><geom type="box" size="0.1 0.2 0.3"/></body>'
    with pytest.raises(SceneError, match="MuJoCo chooses"):
        read(tmp_path, f'<worldbody>{body}</worldbody><keyframe><key qpos="0 0 1 1 0 0 0"/></keyframe>')
    read(tmp_path, f"<worldbody>{body}</worldbody>")


def test_keyframes_start_as_in_mujoco(tmp_path: Path, needs: Callable[[str], None]) -> None:
    """The test compares positions and velocities of all mass centres. The scene has free joints, aligned or not, balls and
    hinges."""
    needs("mujoco")
    import mujoco

    rng = np.random.default_rng(4)
    three = lambda: " ".join(f"{x:.4f}" for x in rng.normal(size=3))  # noqa: E731
    inertial = lambda: f'<inertial pos="{three()}" quat="{three()} 0.7" mass="1" diaginertia="0.02 0.03 0.011"/>'  # noqa: E731
    file = tmp_path / "key.xml"
    for seed in range(8):
        align = ("true", "false", "auto")[seed % 3]
        free = f'<body name="a" pos="{three()}" quat="{three()} 1"><freejoint align="{align}"/>{inertial()}</body>'
        arm = f'<body name="c" pos="{three()}" euler="{three()}"><joint axis="{three()}" ref="0.3"/>{inertial()}</body>'
        ball = f'<body name="b" pos="{three()}" euler="{three()}"><joint type="ball" pos="{three()}"/>{inertial()}{arm}</body>'
        turns = [q / np.linalg.norm(q) for q in rng.normal(size=(2, 4))]
        q = [*rng.normal(size=3), *turns[0], *turns[1], rng.normal()]
        key = f'<key qpos="{" ".join(map(repr, map(float, q)))}" qvel="{" ".join(repr(float(x)) for x in rng.normal(size=10))}"/>'
        compiler = f'<compiler angle="radian" alignfree="{("true", "false")[seed % 2]}"/>'
        file.write_text(f"<mujoco>{compiler}<worldbody>{free}{ball}</worldbody><keyframe>{key}</keyframe></mujoco>")
        m = mujoco.MjModel.from_xml_path(str(file))
        d = mujoco.MjData(m)
        mujoco.mj_resetDataKeyframe(m, d, 0)
        mujoco.mj_forward(m, d)
        scene, _ = scene_of_mjcf(file)
        for body in "abc":
            i, speed = mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_BODY, body), np.zeros(6)
            mujoco.mj_objectVelocity(m, d, mujoco.mjtObj.mjOBJ_BODY, i, speed, 0)
            names = [f"{body}.{what}[{k}]" for what in ("position", "angular_velocity", "velocity") for k in (1, 2, 3)]
            assert column(scene, *names) == pytest.approx([*d.xipos[i], *speed], abs=1e-12)


def test_an_actuator_of_another_part_adds_nothing_to_a_joint_without_a_name(tmp_path: Path) -> None:
    body = f'<body name="b"><joint axis="0 1 0"/>{ARM[ARM.index("<inertial") :]}<site name="s"/></body>'
    scene, _ = read(tmp_path, f'<worldbody>{body}</worldbody><actuator><motor site="s" armature="3" damping="2"/></actuator>')
    (joint,) = scene.joints.values()
    assert (joint.rotor_inertia, joint.damping) == (None, None)
