"""SDF files: poses relative to frames, joints and loops are read correctly (compared with MJCF and closed forms)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import trunnion
from trunnion.analysis.mechanics.state_evaluation import evaluate
from trunnion.basics.errors import SceneError
from trunnion.importers import scene_of_mjcf, scene_of_sdf
from trunnion.scene.data_classes.scene import Scene
from trunnion.simulation.run import Model

WEIGHED = (
    "<inertial><pose>0.2 0.1 0 0.3 0 0</pose><mass>2</mass>"
    "<inertia><ixx>0.3</ixx><iyy>0.4</iyy><izz>0.5</izz></inertia></inertial>"
)


def read(tmp_path: Path, inside: str, version: str = "1.9") -> tuple[Scene, list[str]]:
    file = tmp_path / "model.sdf"
    file.write_text(f'<sdf version="{version}">{inside}</sdf>')
    return scene_of_sdf(file)


def placed(x: float, y: float, z: float, r: float, p: float, w: float) -> np.ndarray:
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = Rotation.from_euler("xyz", [r, p, w]).as_matrix(), (x, y, z)
    return out


def position(scene: Scene, what: str) -> np.ndarray:
    r = trunnion.simulate(scene, 1e-6, 1e-6, outputs=[f"{what}.position[*"])
    return np.array([r[f"{what}.position[{k}]"][0] for k in (1, 2, 3)])


FRAMES = f"""<model name="m"><pose>1 2 3 0.1 0.2 0.3</pose>
  <frame name="f" attached_to="a"><pose>0.5 0 0 0 0 0.7</pose></frame>
  <link name="a"><pose>0 0 1 0 0.4 0</pose>{WEIGHED}</link>
  <link name="b"><pose relative_to="f">0 0.3 0 1.1 0 0</pose>{WEIGHED}</link>
  <model name="n"><pose relative_to="b">0 0 0.2 0 0 0.5</pose>
    <link name="c"><pose degrees="true">0.1 0 0 0 30 0</pose>{WEIGHED}</link></model>
  <joint name="root" type="fixed"><parent>world</parent><child>a</child></joint>
  <joint name="one" type="fixed"><parent>f</parent><child>b</child></joint>
  <joint name="two" type="fixed"><parent>b</parent><child>n::c</child></joint></model>"""


def test_poses_follow_the_frames_they_are_relative_to(tmp_path: Path) -> None:
    scene, _ = read(tmp_path, FRAMES)
    model = placed(1, 2, 3, 0.1, 0.2, 0.3)
    a = model @ placed(0, 0, 1, 0, 0.4, 0)
    b = a @ placed(0.5, 0, 0, 0, 0, 0.7) @ placed(0, 0.3, 0, 1.1, 0, 0)
    c = b @ placed(0, 0, 0.2, 0, 0, 0.5) @ placed(0.1, 0, 0, 0, np.pi / 6, 0)
    for name, at in (("a", a), ("b", b), ("c", c)):
        assert position(scene, name) == pytest.approx((at @ [0.2, 0.1, 0, 1])[:3], abs=1e-13), name


ARM = f"""<model name="arm"><pose>0 0 1 0 0 0.4</pose>
  <link name="upper"><pose>0.1 0 0 0 0.3 0</pose>{WEIGHED}</link>
  <link name="lower"><pose>0.8 0 0.2 0.5 0 0</pose>{WEIGHED}</link>
  <link name="slide"><pose>0.9 0.1 0.2 0 0 0</pose>{WEIGHED}</link>
  <joint name="shoulder" type="revolute"><parent>world</parent><child>upper</child><pose>0.05 0 0 0 0 0.2</pose>
    <axis><xyz>0 1 0.2</xyz><dynamics><damping>0.3</damping><spring_stiffness>4</spring_stiffness>
    <spring_reference>0.5</spring_reference></dynamics></axis></joint>
  <joint name="elbow" type="continuous"><parent>upper</parent><child>lower</child>
    <axis><xyz expressed_in="__model__">1 0 0</xyz><dynamics><friction>0.2</friction></dynamics></axis></joint>
  <joint name="rail" type="prismatic"><parent>lower</parent><child>slide</child><axis><xyz>0 0 1</xyz></axis></joint></model>"""


def mjcf_of_arm() -> str:
    """The arm in MJCF, with poses and axes that the test computes."""
    model = placed(0, 0, 1, 0, 0, 0.4)
    at = {"upper": model @ placed(0.1, 0, 0, 0, 0.3, 0), "lower": model @ placed(0.8, 0, 0.2, 0.5, 0, 0),
          "slide": model @ placed(0.9, 0.1, 0.2, 0, 0, 0)}  # fmt: skip
    text = lambda v: " ".join(f"{x:.17g}" for x in np.ravel(v))  # noqa: E731
    joints = {
        "upper": f'type="hinge" pos="0.05 0 0" axis="{text(placed(0, 0, 0, 0, 0, 0.2)[:3, :3] @ [0, 1, 0.2])}" damping="0.3" '
                 f'stiffness="4" springref="{np.rad2deg(0.5):.17g}"',
        "lower": f'type="hinge" axis="{text(at["lower"][:3, :3].T @ model[:3, 0])}"', "slide": 'type="slide" axis="0 0 1"',
    }  # fmt: skip
    names, open_, close = {"upper": "shoulder", "lower": "elbow", "slide": "rail"}, "", ""
    before = np.eye(4)
    for link in joints:
        rel = np.linalg.inv(before) @ at[link]
        q = Rotation.from_matrix(rel[:3, :3]).as_quat()
        weighed = f'<inertial pos="0.2 0.1 0" euler="{np.rad2deg(0.3):.17g} 0 0" mass="2" diaginertia="0.3 0.4 0.5"/>'
        open_ += f'<body name="{link}" pos="{text(rel[:3, 3])}" quat="{text(np.roll(q, 1))}">'
        open_ += f'<joint name="{names[link]}" {joints[link]}/>{weighed}'
        close += "</body>"
        before = at[link]
    return f"<mujoco><worldbody>{open_}{close}</worldbody></mujoco>"


def test_an_arm_moves_as_the_same_arm_in_mjcf(tmp_path: Path) -> None:
    one, _ = read(tmp_path, ARM)
    (tmp_path / "arm.xml").write_text(mjcf_of_arm())
    two, _ = scene_of_mjcf(tmp_path / "arm.xml")
    assert one.joints["elbow"].friction.torque == 0.2
    bare = replace(one, joints={n: replace(j, friction=None) for n, j in one.joints.items()})
    q = {"shoulder": np.array([0.4]), "elbow": np.array([-0.7]), "rail": np.array([0.3])}
    qd = {"shoulder": np.array([1.1]), "elbow": np.array([0.6]), "rail": np.array([-0.5])}
    rows = [evaluate(Model(s, ("*.qdd[*",)), q, qd, 0.0) for s in (bare, two)]
    for name in q:
        assert rows[0][f"{name}.qdd[1]"] == pytest.approx(rows[1][f"{name}.qdd[1]"], rel=1e-12), name


def bar(name: str, x: float, z: float, lean: float, length: float) -> str:
    inertia = f"<inertia><ixx>{length**2 / 12}</ixx><iyy>{length**2 / 12}</iyy><izz>1e-6</izz></inertia>"
    inertial = f"<inertial><pose>0 0 {length / 2} 0 0 0</pose><mass>1</mass>{inertia}</inertial>"
    return f'<link name="{name}"><pose>{x} 0 {z} 0 {lean} 0</pose>{inertial}</link>'


def hinge(name: str, parent: str, child: str, at: str = "0 0 0 0 0 0") -> str:
    return (f'<joint name="{name}" type="revolute"><parent>{parent}</parent><child>{child}</child><pose>{at}</pose>'
            "<axis><xyz>0 1 0</xyz></axis></joint>")  # fmt: skip


def test_two_joints_with_one_child_close_a_loop(tmp_path: Path) -> None:
    """A parallelogram oscillates like one pendulum: two legs of length 1 and a coupler that does not turn. The masses are 1, and
    the inertia of a leg about its end is 1/3. The motion starts at an angle of 0.3 and follows (2/3 + 1) q̈ = (2 ½ + 1) g sin q."""
    lean = 0.3
    x, z = np.sin(lean), np.cos(lean)
    inertial = "<inertial><pose>0.5 0 0 0 0 0</pose><mass>1</mass></inertial>"
    coupler = f'<link name="coupler"><pose>{x:.17g} 0 {z:.17g} 0 0 0</pose>{inertial}</link>'
    links = bar("left", 0, 0, lean, 1) + bar("right", 1, 0, lean, 1) + coupler
    joints = hinge("a", "world", "left") + hinge("b", "world", "right") + hinge("c", "left", "coupler") + hinge(
        "d", "right", "coupler", "1 0 0 0 0 0")  # fmt: skip
    scene, _ = read(tmp_path, f'<model name="p">{links}{joints}</model>')
    r = trunnion.simulate(scene, 0.5, 0.1, rtol=1e-10, outputs=["a.q[1]", "a.qdd[1]"])
    assert r["a.qdd[1]"][0] == pytest.approx(9.81 * 2 * np.sin(lean) / (2 / 3 + 1), rel=1e-12)
    angle = lean + r["a.q[1]"]
    assert r["a.qdd[1]"] == pytest.approx(9.81 * 2 * np.sin(angle) / (2 / 3 + 1), rel=1e-8)


def test_ball_cross_screw_and_hinges_in_series_are_taken_over(tmp_path: Path) -> None:
    """A ball, two crossing axes, a thread (2 m a turn, written as −π rad/m), two hinges in series."""
    links = "".join(f'<link name="{n}"><pose>{i} 0 0 0 0 0</pose>{WEIGHED}</link>' for i, n in enumerate("abcd"))
    axes = "<axis><xyz>1 0 0</xyz></axis><axis2><xyz>0 1 0</xyz></axis2>"
    joints = f"""<joint name="ball" type="ball"><parent>world</parent><child>a</child></joint>
      <joint name="cross" type="universal"><parent>a</parent><child>b</child>{axes}</joint>
      <joint name="thread" type="screw"><parent>b</parent><child>c</child><thread_pitch>{-np.pi}</thread_pitch>{axes}</joint>
      <joint name="pair" type="revolute2"><parent>c</parent><child>d</child>{axes}</joint>"""
    scene, _ = read(tmp_path, f'<model name="m">{links}{joints}</model>')
    kinds = {n: j.type for n, j in scene.joints.items()}
    assert kinds == {"ball": "spherical", "cross": "universal", "thread": "screw", "pair_1": "revolute", "pair_2": "revolute"}
    assert scene.joints["thread"].pitch == pytest.approx(2.0)
    assert trunnion.simulate(scene, 0.1).outcome.ok


def test_a_link_without_joint_falls_and_a_static_model_stands(tmp_path: Path) -> None:
    text = f"""<world name="w"><gravity>0 0 -2</gravity>
      <model name="floor"><static>true</static><link name="slab"/></model>
      <model name="stone"><pose>1 2 3 0 0 0.5</pose><link name="rock">{WEIGHED}</link></model>
      <model name="cloud"><link name="drop"><gravity>false</gravity>{WEIGHED}</link></model></world>"""
    scene, notes = read(tmp_path, text)
    assert set(scene.bodies) == {"rock", "drop"}
    r = trunnion.simulate(scene, 1.0, 1.0, outputs=["rock.position[3]", "drop.position[3]"])
    assert (r["rock.position[3]"][-1], r["drop.position[3]"][-1]) == (pytest.approx(2.0), pytest.approx(0.0, abs=1e-12))
    assert not notes


def test_included_models_are_found_beside_the_file(tmp_path: Path) -> None:
    (tmp_path / "leg").mkdir()
    foot = f'<link name="foot">{WEIGHED}</link>'
    (tmp_path / "leg" / "model.sdf").write_text(f'<sdf version="1.9"><model name="leg">{foot}</model></sdf>')
    one = "<include><uri>model://leg</uri><name>left</name><pose>0 1 0 0 0 0</pose></include>"
    scene, _ = read(tmp_path, f'<world name="w">{one}{one.replace("left", "right").replace("0 1 0 0", "0 -1 0 0")}</world>')
    assert [position(scene, n)[1] for n in scene.bodies] == pytest.approx([1.1, -0.9])


def test_a_joint_that_mimics_another_follows_it_from_its_reference(tmp_path: Path) -> None:
    mimic = '<mimic joint="j" axis="axis"><multiplier>-2</multiplier><offset>0.3</offset><reference>0.1</reference></mimic>'
    one = '<joint name="j" type="revolute"><parent>world</parent><child>a</child><axis><xyz>0 1 0</xyz></axis></joint>'
    two = f'<joint name="k" type="revolute"><parent>a</parent><child>b</child><axis><xyz>0 1 0</xyz>{mimic}</axis></joint>'
    weighed = "<pose>0.1 0 {} 0 0 0</pose><inertial><pose>0.2 0 0 0 0 0</pose><mass>1</mass></inertial>"
    links = "".join(f'<link name="{n}">{weighed.format(z)}</link>' for n, z in (("a", 0), ("b", 0.2)))
    scene, _ = read(tmp_path, f'<model name="m">{links}{one}{two}</model>')
    r = trunnion.simulate(scene, 0.5, 0.1)
    assert r["k.q[1]"] == pytest.approx(0.3 - 2 * (r["j.q[1]"] - 0.1), abs=1e-12)


REFUSED = {
    "a gearbox": ('<joint name="j" type="gearbox"><parent>a</parent><child>b</child></joint>', "type 'gearbox'"),
    "a follower": (
        '<joint name="j" type="revolute"><parent>a</parent><child>b</child><axis><mimic joint="k"/></axis></joint>', "unknown"),
    "no link": ('<joint name="j" type="ball"><parent>nothing</parent><child>b</child></joint>', "not a link"),
    "no frame": ('<frame name="f"><pose relative_to="nothing">0 0 0 0 0 0</pose></frame>', "an unknown frame"),
    "frames in a ring": (
        '<frame name="f"><pose relative_to="g"/></frame><frame name="g"><pose relative_to="f"/></frame>', "relative to it"),
    "no model": ("<include><uri>model://nothing</uri></include>", "no model 'model://nothing'"),
    "outside": ("<include><uri>../../etc/model.sdf</uri></include>", "no model"),
    "a pose of two": ('<frame name="f"><pose>1 2</pose></frame>', "6 numbers"),
    "mass from shapes": ('<link name="c"><inertial auto="true"/></link>', "computed from collisions"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_unsupported_content_is_refused_with_its_line(what: str, tmp_path: Path) -> None:
    text, words = REFUSED[what]
    links = "".join(f'<link name="{n}">{WEIGHED}</link>' for n in "ab")
    with pytest.raises(SceneError, match=words) as e:
        read(tmp_path, f'\n<model name="m">{links}\n{text}</model>')
    assert {p.line for p in e.value.problems} == {3}


def test_masses_that_the_file_does_not_say_are_reported(tmp_path: Path) -> None:
    _, notes = read(tmp_path, '<model name="m"><link name="a"/></model>')
    assert any("1 kg" in n and "a" in n for n in notes)


WRONG = {
    "an unknown placement frame": (
        '<model name="m" placement_frame="gone"><link name="a">{link}</link></model>', "placement_frame",
    ),
    "a quaternion of zeros": (
        '<model name="m"><link name="a"><pose rotation_format="quat_xyzw">0 0 0 0 0 0 0</pose>{link}</link></model>',
        "quaternion is 0",
    ),
    "two axes along one line": (
        '<model name="m"><link name="a">{link}</link><joint name="j" type="universal"><parent>world</parent><child>a</child>'
        "<axis><xyz>1 0 0</xyz></axis><axis2><xyz>2 0 0</xyz></axis2></joint></model>", "two axes are parallel",
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", WRONG)
def test_a_frame_or_an_axis_that_means_nothing_is_a_problem(what: str, tmp_path: Path) -> None:
    text, problem = WRONG[what]
    with pytest.raises(SceneError, match=problem):
        read(tmp_path, text.format(link=WEIGHED))


def test_forces_along_an_axis_of_a_ball_are_refused_with_their_line(tmp_path: Path) -> None:
    axis = "<axis>\n<xyz>0 1 0</xyz><dynamics><damping>0.3</damping></dynamics></axis>"
    ball = f'<joint name="j" type="ball"><parent>world</parent><child>a</child>\n{axis}</joint>'
    with pytest.raises(SceneError, match="no axis") as e:
        read(tmp_path, f'<model name="m"><link name="a">{WEIGHED}</link>{ball}</model>')
    assert [(p.where, p.line) for p in e.value.problems] == [("j.axis", 2)]
